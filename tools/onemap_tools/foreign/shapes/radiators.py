"""Heating radiators."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.finish import finished
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import (
    block,
    curve,
    cushion,
    joined,
    loft,
    ring,
    tube,
)
from onemap_tools.foreign.shapes.parts import Parts, frame, vessel


def radiator(variant: int, look: FinishPicker) -> Parts:
    """A heating radiator at a wall: ribs, plates, or a ladder for towels."""
    w = look.between(0.7, 1.1)
    h = look.between(0.5, 0.65)
    makers = (
        lambda: _ribbed_radiator(look, w, h, variant),
        lambda: _plate_radiator(look, w, h, variant),
        lambda: _towel_ladder(look, variant),
        lambda: _column_radiator(look, w, h, variant),
        lambda: _ribbed_radiator(look, w, h, variant),
        lambda: _plate_radiator(look, w, h, variant),
        lambda: _towel_ladder(look, variant),
        lambda: _covered_radiator(look, w, h),
    )
    return makers[variant]()


def _ribbed_radiator(look: FinishPicker, w: float, h: float, variant: int) -> Parts:
    paint = look.lacquer((0.9, 0.9, 0.88)) if variant != 4 else look.iron()
    count = int(w / 0.075)
    rib = loft(
        [ring(0.05, 0.13, z, 2.5, 20) for z in (0.1, 0.14)]
        + [ring(0.045, 0.11, 0.1 + h - 0.04, 2.5, 20), ring(0.03, 0.08, 0.1 + h, 2.5, 20)]
    )
    return [
        finished(
            joined(
                [rib.at((i + 0.5) * 0.075 - count * 0.0375) for i in range(count)]
                + [tube([(-w / 2, 0, z), (w / 2, 0, z)], 0.02) for z in (0.16, 0.05 + h)]
            ),
            paint,
        )
    ]


def _plate_radiator(look: FinishPicker, w: float, h: float, variant: int) -> Parts:
    paint = look.lacquer((0.9, 0.9, 0.88)) if variant != 4 else look.iron()
    ribs = [
        cushion(0.028, 0.03, h - 0.06, 0.01).at(x, -0.045, 0.13)
        for x in np.arange(-w / 2 + 0.03, w / 2 - 0.02, 0.04)
    ]
    slab = block(w, 0.07, h, 0.01).at(z=0.1)
    return [
        finished(joined([slab, *(ribs if variant == 1 else [])]), paint),
        finished(tube([(w / 2, 0, 0.15), (w / 2 + 0.06, 0, 0.15)], 0.02), look.chrome()),
    ]


def _towel_ladder(look: FinishPicker, variant: int) -> Parts:
    paint = look.lacquer((0.9, 0.9, 0.88)) if variant != 4 else look.iron()
    bars = [
        tube(curve([(-0.25, 0, z), (0, -0.06 if variant == 2 else 0, z), (0.25, 0, z)]), 0.012)
        for z in np.linspace(0.25, 1.3, 15)
        if not 0.7 < z < 0.78
    ]
    rails = [tube([(s * 0.25, 0, 0.15), (s * 0.25, 0, 1.4)], 0.02) for s in (-1, 1)]
    return [finished(joined([*bars, *rails]), look.chrome() if variant == 2 else paint)]


def _column_radiator(look: FinishPicker, w: float, h: float, variant: int) -> Parts:
    paint = look.lacquer((0.9, 0.9, 0.88)) if variant != 4 else look.iron()
    columns = [
        tube([(x, y, 0.1), (x, y, 0.1 + h)], 0.012)
        for x in np.arange(-w / 2, w / 2, 0.05)
        for y in (-0.035, 0.035)
    ]
    return [
        finished(
            joined(
                [
                    *columns,
                    *(tube([(-w / 2, 0, z), (w / 2, 0, z)], 0.024) for z in (0.12, 0.08 + h)),
                ]
            ),
            paint,
        )
    ]


def _covered_radiator(look: FinishPicker, w: float, h: float) -> Parts:
    slats = [
        block(0.02, 0.03, h - 0.1, 0.004).at(x, -0.08, 0.16)
        for x in np.arange(-w / 2 + 0.05, w / 2 - 0.04, 0.045)
    ]
    return [
        finished(
            joined(
                [
                    frame(w + 0.1, h + 0.12, 0.06, 0.03).at(0, -0.07, 0.06),
                    *slats,
                    block(w + 0.16, 0.2, 0.03, 0.006).at(z=h + 0.16),
                ]
            ),
            look.lacquer(),
        ),
        finished(
            vessel([(0.02, h + 0.19), (0.06, h + 0.25), (0.03, h + 0.36), (0.04, h + 0.38)]),
            look.ceramic(),
        ),
    ]
