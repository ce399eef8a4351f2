"""Draws the map of a demo run with the driven path and the claimed objects."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from onemap_gateway.present.render import Overlay, encode_png, render_map
from onemap_shared.messages import SearchView
from onemap_shared.trail import PointM
from onemap_tools.demo.summary import ObjectSummary

MIN_PIXELS_PER_CELL = 8


def write_picture(
    path: Path,
    view: SearchView,
    *,
    trail_m: Sequence[PointM],
    yaw_rad: float,
    objects: tuple[ObjectSummary, ...],
) -> None:
    """Write a PNG of the map, the driven path ``trail_m`` (x, y in metres) and the claims."""
    found = tuple(
        (
            item.name if item.success else f"{item.name} (wrong)",
            item.position_m[0],
            item.position_m[1],
        )
        for item in objects
        if len(item.position_m) >= 2
    )
    overlay = Overlay(
        trail_m=np.array(trail_m, dtype=np.float64).reshape(-1, 2),
        robot=(*trail_m[-1], yaw_rad) if trail_m else (),
        found=found,
    )
    path.write_bytes(encode_png(render_map(view, overlay, MIN_PIXELS_PER_CELL).image))
