"""The benchmark's page: metrics, a plot of SPL by position, and every episode's trajectory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape as html_text
from typing import Any

from onemap_tools.bench.navigation.metrics import Estimate
from onemap_tools.bench.navigation.records import EpisodeRecord
from onemap_tools.bench.navigation.report import comparison_lines, episode_line, title

WIDTH_PX, HEIGHT_PX, MARGIN_PX, BAR_PX = 420, 260, 40, 60
STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em}"
    "table{border-collapse:collapse}td,th{padding:.15em 1em .15em 0;text-align:left}"
    "figure{margin:2em 0}img{max-width:100%;border:1px solid #ccc}"
)


def picture_name(index: int) -> str:
    """File name of an episode's picture."""
    return f"episode_{index:04d}.png"


def page_html(result: Mapping[str, Any], episodes: Sequence[EpisodeRecord]) -> str:
    """The page; pictures are files beside it."""
    heading = f"{result['method']}, {result['features']} features"
    rows = "".join(
        f"<tr><td>{html_text(title(name))}</td><td>{Estimate(**values)}</td></tr>"
        for name, values in result["metrics"].items()
    )
    failures = "".join(
        f"<tr><td>{html_text(reason)}</td><td>{count}</td></tr>"
        for reason, count in result["failures"].items()
    )
    figures = "".join(
        f'<figure><img loading="lazy" src="{picture_name(each.index)}" alt="trajectory">'
        f"<figcaption>{html_text(episode_line(each))}</figcaption></figure>"
        for each in episodes
    )
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html_text(heading)}</title>'
        f"<style>{STYLE}</style><h1>{html_text(heading)}</h1>"
        f"<p>{result['episodes']} episodes of {result['objects_per_episode']} objects, "
        f"apartments from seed {result['seed']} ({result['apartments']}, {result['style']}). "
        "Values with 95 % bootstrap intervals over episodes.</p>"
        f"<table>{rows}</table><h2>SPL by position</h2>{spl_plot(result['metrics'])}"
        f"{_comparison(result)}<h2>Failures</h2><table>{failures}</table>"
        "<h2>Episodes</h2><p>Red: the start. The path to the first object is blue, to the second "
        f"green, to the third orange, then again from blue.</p>{figures}</html>\n"
    )


def _comparison(result: Mapping[str, Any]) -> str:
    lines = "".join(f"<li>{html_text(line)}</li>" for line in comparison_lines(result))
    return f"<h2>Beside other methods</h2><ul>{lines}</ul>" if lines else ""


def spl_plot(metrics: Mapping[str, Mapping[str, float | None]]) -> str:
    """An SVG of the SPL of each position with its interval."""
    bars = []
    for position in range(1, len(metrics) + 1):
        values = metrics.get(f"spl_{position}")
        if values is not None and values["value"] is not None:
            bars.append(_bar(position, Estimate(**values)))
    base = HEIGHT_PX - MARGIN_PX
    ticks = "".join(
        f'<text x="4" y="{_y(share) + 4:.0f}">{share:.2f}</text>'
        f'<line x1="{MARGIN_PX}" x2="{WIDTH_PX}" y1="{_y(share):.1f}" y2="{_y(share):.1f}" '
        'stroke="#ddd"/>'
        for share in (0.0, 0.25, 0.5, 0.75, 1.0)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH_PX}" height="{HEIGHT_PX}" '
        f'font-family="sans-serif" font-size="12">{ticks}{"".join(bars)}'
        f'<line x1="{MARGIN_PX}" x2="{WIDTH_PX}" y1="{base}" y2="{base}" stroke="#333"/></svg>\n'
    )


def _bar(position: int, spl: Estimate) -> str:
    left = MARGIN_PX + 20 + (position - 1) * 2 * BAR_PX
    middle, top = left + BAR_PX / 2, _y(spl.value or 0.0)
    low, high = _y(spl.low or 0.0), _y(spl.high or 0.0)
    return (
        f'<rect x="{left}" y="{top:.1f}" width="{BAR_PX}" height="{_y(0.0) - top:.1f}" '
        'fill="#5b8fd6"/>'
        f'<line x1="{middle}" x2="{middle}" y1="{low:.1f}" y2="{high:.1f}" stroke="#222"/>'
        f'<text x="{middle}" y="{HEIGHT_PX - 20}" text-anchor="middle">object {position}</text>'
    )


def _y(share: float) -> float:
    """Pixel row of an SPL."""
    return HEIGHT_PX - MARGIN_PX - share * (HEIGHT_PX - 2 * MARGIN_PX)
