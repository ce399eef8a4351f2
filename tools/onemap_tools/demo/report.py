"""Prints the summary of a demo as a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from onemap_gateway.present.canvas import Canvas, Viewport
from onemap_gateway.present.render import Overlay, draw_overlay, encode_png, render_map
from onemap_shared.messages import SearchView
from onemap_shared.trail import PointM
from onemap_tools.demo.summary import DemoSummary, ObjectSummary


def describe(summary: DemoSummary, document: dict[str, Any], console: Console) -> None:
    """Print one row per object, the reasons of failures, totals and the picture's path."""
    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for title in ("object", "outcome", "at", "time", "path", "shortest", "SPL", "off by"):
        table.add_column(title, no_wrap=title != "outcome")
    for item in summary.objects:
        table.add_row(*_row(item))
    for name in summary.not_sought:
        table.add_row(name, Text("not sought", style="dim"))
    console.print(table)
    if summary.robots:
        console.print(_robots(summary))
    for item in summary.objects:
        if not item.counts_as_found:
            console.print(f"{item.name}: {_why(item)}")
    if summary.failure:
        console.print(Text(summary.failure, style="red"))
    console.print(
        f"{summary.found} of {len(summary.wanted)} found in {summary.search_s:.0f} s "
        f"({summary.duration_s:.0f} s with starting up), {_verdict(summary)}, "
        f"{summary.map_rate_hz:.1f} map updates/s",
        highlight=False,
    )
    if summary.robots:
        console.print(
            f"Closest to each other: {metres(summary.closest_m)}, middle to middle. They neither "
            "see nor touch one another: each is simulated on its own.",
            highlight=False,
        )
    if document["picture"]:
        console.print(
            f"Map, path and finds: {document['picture']}", highlight=False, soft_wrap=True
        )


def _robots(summary: DemoSummary) -> Table:
    """A row per robot."""
    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for title in ("robot", "found", "path", "time", "contacts"):
        table.add_column(title, no_wrap=title != "found")
    for robot in summary.robots:
        contacts = "-" if robot.contacts is None else str(robot.contacts)
        found = Text(", ".join(robot.found) or "nothing")
        table.add_row(
            robot.name, found, metres(robot.path_length_m), f"{robot.search_s:.0f} s", contacts
        )
    return table


def _why(item: ObjectSummary) -> str:
    """The reason of an outcome; for a wrong claim also the thing that is nearest to it."""
    if item.claimed_wrongly and item.nearest:
        return f"{item.reason} (nearest to the claimed place: {item.nearest})"
    return item.reason


def _verdict(summary: DemoSummary) -> str:
    """Wrong claims and SPL, or for how many objects there is ground truth."""
    wrong = f"{summary.claimed_wrongly} claimed wrongly"
    if summary.judged == len(summary.objects):
        return f"{wrong}, SPL {summary.spl:.2f}"
    known = f"ground truth for {summary.judged} of {len(summary.objects)}"
    return f"{known}, {wrong}" if summary.judged else "no ground truth"


def _row(item: ObjectSummary) -> tuple[str | Text, ...]:
    outcome = item.outcome.replace("_", " ")
    style = "green" if item.success else "red"
    if item.claimed_wrongly:
        outcome = "wrong one"
    elif item.claimed and not item.judged:
        outcome, style = "found (no ground truth)", "yellow"
    place = ", ".join(f"{value:.1f}" for value in item.position_m[:2])
    return (
        item.name,
        Text(outcome, style=style),
        f"({place})" if place else "-",
        f"{item.time_s:.0f} s",
        metres(item.path_length_m),
        metres(item.shortest_path_m),
        f"{item.spl:.2f}" if item.judged else "-",
        metres(item.true_distance_m),
    )


def metres(value: float) -> str:
    """A length in metres; a dash if it is not finite."""
    return f"{value:.1f} m" if isfinite(value) else "-"


MIN_PIXELS_PER_CELL = 8


@dataclass(frozen=True, slots=True)
class DrivenPath:
    """The path of a robot, x and y in metres, and its heading at the end."""

    trail_m: Sequence[PointM]
    yaw_rad: float

    @property
    def overlay(self) -> Overlay:
        """The path, and the robot at its end."""
        return Overlay(
            trail_m=np.array(self.trail_m, dtype=np.float64).reshape(-1, 2),
            robot=(*self.trail_m[-1], self.yaw_rad) if self.trail_m else (),
        )


def write_picture(
    path: Path, view: SearchView, drives: Sequence[DrivenPath], objects: Sequence[ObjectSummary]
) -> None:
    """Write a PNG of the map, the drives, at least one, and the claims over them."""
    found = tuple(
        (
            item.name if item.success else f"{item.name} (wrong)",
            item.position_m[0],
            item.position_m[1],
        )
        for item in objects
        if len(item.position_m) >= 2
    )
    first, *others = (drive.overlay for drive in drives)
    drawn = render_map(view, first, MIN_PIXELS_PER_CELL)
    x_min, _, _, y_max = drawn.bounds_m
    viewport = Viewport(x_min, y_max, drawn.pixels_per_cell / view.grid.cell_size_m)
    for overlay in (*others, Overlay(found=found)):
        draw_overlay(Canvas(drawn.image, viewport), overlay)
    path.write_bytes(encode_png(drawn.image))
