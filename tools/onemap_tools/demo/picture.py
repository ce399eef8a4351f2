"""Draws the map of a demo run with the driven paths and the claimed objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from onemap_gateway.present.canvas import Canvas, Viewport
from onemap_gateway.present.render import Overlay, draw_overlay, encode_png, render_map
from onemap_shared.messages import SearchView
from onemap_shared.trail import PointM
from onemap_tools.demo.summary import ObjectSummary

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
