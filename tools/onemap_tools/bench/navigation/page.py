"""The benchmark's page: metrics, a plot of SPL by position, and every episode's trajectory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape as html_text
from typing import Any

from onemap_tools.bench.navigation.metrics import Estimate
from onemap_tools.bench.navigation.records import EpisodeRecord
from onemap_tools.bench.navigation.report import comparison_lines, episode_line, setting, title

HEIGHT_PX, MARGIN_PX, BAR_PX = 260, 40, 44
Metrics = Mapping[str, Mapping[str, float | None]]
STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em}"
    "table{border-collapse:collapse}td,th{padding:.15em 1em .15em 0;text-align:left}"
    "figure{margin:2em 0}img{max-width:100%;border:1px solid #ccc}"
)
LEGEND = (
    "<p>Red: the start. The path to the first object is blue, to the second green, to the third "
    "orange, then again from blue.</p>"
)


def picture_name(index: int) -> str:
    """File name of an episode's picture."""
    return f"episode_{index:04d}.png"


def page_html(result: Mapping[str, Any], episodes: Sequence[EpisodeRecord]) -> str:
    """The page; pictures of apartments are files beside it, a run that is ``about`` another
    world has none."""
    heading = setting(result)
    rows = "".join(
        f"<tr><td>{html_text(title(name))}</td><td>{Estimate(**values)}</td></tr>"
        for name, values in result["metrics"].items()
    )
    failures = "".join(
        f"<tr><td>{html_text(reason)}</td><td>{count}</td></tr>"
        for reason, count in result["failures"].items()
    )
    figures = "".join(_figure(each, has_picture=not result.get("about")) for each in episodes)
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html_text(heading)}</title>'
        f"<style>{STYLE}</style><h1>{html_text(heading)}</h1>"
        f"<p>{html_text(result.get('about') or _about(result))} "
        "Values with 95 % bootstrap intervals over episodes.</p>"
        f"<table>{rows}</table><h2>SPL by position</h2>{spl_plot(metrics_by_method(result))}"
        f"{_comparison(result)}<h2>Failures</h2><table>{failures}</table>"
        f"<h2>Episodes</h2>{'' if result.get('about') else LEGEND}{figures}</html>\n"
    )


def _about(result: Mapping[str, Any]) -> str:
    return (
        f"{result['episodes']} episodes of {result['objects_per_episode']} objects, "
        f"apartments from seed {result['seed']} ({result['apartments']}, {result['style']})."
    )


def _figure(episode: EpisodeRecord, *, has_picture: bool) -> str:
    picture = f'<img loading="lazy" src="{picture_name(episode.index)}" alt="trajectory">'
    caption = html_text(episode_line(episode))
    return f"<figure>{picture * has_picture}<figcaption>{caption}</figcaption></figure>"


def _comparison(result: Mapping[str, Any]) -> str:
    lines = "".join(f"<li>{html_text(line)}</li>" for line in comparison_lines(result))
    return f"<h2>Beside other methods</h2><ul>{lines}</ul>" if lines else ""


def metrics_by_method(result: Mapping[str, Any]) -> dict[str, Metrics]:
    """The metrics of this run and of those beside it."""
    others = {method: other["metrics"] for method, other in result["compared_with"].items()}
    return {result["method"]: result["metrics"], **others}


def spl_plot(methods: Mapping[str, Metrics]) -> str:
    """An SVG of the SPL of the first, second, third object with intervals, grouped by method."""
    groups = {name: _spl_by_position(metrics) for name, metrics in methods.items()}
    step_px = BAR_PX * (1 + max(map(len, groups.values()), default=1))
    width_px = MARGIN_PX + step_px * len(groups)
    base = HEIGHT_PX - MARGIN_PX
    ticks = "".join(
        f'<text x="4" y="{_y(share) + 4:.0f}">{share:.2f}</text>'
        f'<line x1="{MARGIN_PX}" x2="{width_px}" y1="{_y(share):.1f}" y2="{_y(share):.1f}" '
        'stroke="#ddd"/>'
        for share in (0.0, 0.25, 0.5, 0.75, 1.0)
    )
    bars = "".join(
        _group(name, spl, MARGIN_PX + step_px * index + BAR_PX // 2)
        for index, (name, spl) in enumerate(groups.items())
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width_px}" height="{HEIGHT_PX}" '
        f'font-family="sans-serif" font-size="12">{ticks}{bars}'
        f'<line x1="{MARGIN_PX}" x2="{width_px}" y1="{base}" y2="{base}" stroke="#333"/></svg>\n'
    )


def _spl_by_position(metrics: Metrics) -> dict[int, Estimate]:
    """The positions for which there is a value."""
    named = {k: metrics[f"spl_{k}"] for k in range(1, len(metrics) + 1) if f"spl_{k}" in metrics}
    return {k: Estimate(**each) for k, each in named.items() if each["value"] is not None}


def _group(method: str, spl: Mapping[int, Estimate], left_px: int) -> str:
    bars = "".join(
        _bar(position, each, left_px + index * BAR_PX)
        for index, (position, each) in enumerate(spl.items())
    )
    middle = left_px + BAR_PX * len(spl) / 2
    name = html_text(method)
    return f'{bars}<text x="{middle}" y="{HEIGHT_PX - 6}" text-anchor="middle">{name}</text>'


def _bar(position: int, spl: Estimate, left_px: int) -> str:
    middle, top = left_px + BAR_PX / 2, _y(spl.value or 0.0)
    low, high = _y(spl.low or 0.0), _y(spl.high or 0.0)
    return (
        f'<rect x="{left_px + 2}" y="{top:.1f}" width="{BAR_PX - 4}" '
        f'height="{_y(0.0) - top:.1f}" fill="#5b8fd6"/>'
        f'<line x1="{middle}" x2="{middle}" y1="{low:.1f}" y2="{high:.1f}" stroke="#222"/>'
        f'<text x="{middle}" y="{HEIGHT_PX - 24}" text-anchor="middle">{position}</text>'
    )


def _y(share: float) -> float:
    """Pixel row of an SPL."""
    return HEIGHT_PX - MARGIN_PX - share * (HEIGHT_PX - 2 * MARGIN_PX)
