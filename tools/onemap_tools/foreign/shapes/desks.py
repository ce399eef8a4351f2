"""Desks, their backs to a wall."""

from __future__ import annotations

from onemap_tools.foreign.finish import finished
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import (
    block,
    joined,
    tube,
)
from onemap_tools.foreign.shapes.parts import Parts, drawer_block, handle, legs


def desk(variant: int, look: FinishPicker) -> Parts:
    """A desk to work at, 0.74 m high; its back stands to a wall."""
    w = look.between(1.15, 1.5)
    d = look.between(0.6, 0.72)
    h = 0.74
    makers = (
        lambda: _one_pedestal_desk(look, w, d, h),
        lambda: _iron_desk(look, w, d, h),
        lambda: _two_pedestal_desk(look, w, d, h),
        lambda: _bureau(look, w, d, h),
        lambda: _lifting_desk(look, w, d, h),
        lambda: _glass_desk(look, w, d, h),
        lambda: _tower_desk(look, w, d, h),
        lambda: _trestle_desk(look, w, d, h),
    )
    return makers[variant]()


def _one_pedestal_desk(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    top = block(w, d, 0.03, 0.006).at(z=h - 0.03)
    drawers = drawer_block(0.4, d - 0.06, h - 0.03, 3, 0)
    return [
        finished(
            joined(
                [
                    top,
                    drawers.at(w / 2 - 0.22),
                    block(0.03, d - 0.05, h - 0.03).at(-w / 2 + 0.03),
                ]
            ),
            wood,
        ),
        *_knobs(look, w / 2 - 0.22, d, h, 3),
    ]


def _iron_desk(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    top = block(w, d, 0.03, 0.006).at(z=h - 0.03)
    return [
        finished(top, wood),
        finished(
            joined(
                [
                    legs(w, d, h - 0.03, 0),
                    tube(
                        [(-w / 2 + 0.05, d / 2 - 0.05, 0.2), (w / 2 - 0.05, d / 2 - 0.05, 0.2)],
                        0.015,
                    ),
                ]
            ),
            look.iron(),
        ),
    ]


def _two_pedestal_desk(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    top = block(w, d, 0.03, 0.006).at(z=h - 0.03)
    sides = joined(
        [drawer_block(0.36, d - 0.04, h - 0.03, 4, 2).at(s * (w / 2 - 0.19)) for s in (-1, 1)]
    )
    return [
        finished(joined([top, sides, block(w - 0.1, 0.02, 0.3).at(0, d / 2 - 0.06, 0.4)]), wood),
        *_knobs(look, w / 2 - 0.19, d, h, 4),
        *_knobs(look, 0.19 - w / 2, d, h, 4),
    ]


def _bureau(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    top = block(w, d, 0.03, 0.006).at(z=h - 0.03)
    flap = joined([top, legs(w, d, h, 1, 0.07), block(w, 0.25, 0.16, 0.008).at(0, d / 2 - 0.13, h)])
    holes = joined(
        [
            block(w / 5 - 0.03, 0.02, 0.1, 0.002).at((i - 2) * w / 5, d / 2 - 0.255, h + 0.03)
            for i in range(5)
        ]
    )
    return [finished(flap, wood), finished(holes, look.lacquer())]


def _lifting_desk(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    top = block(w, d, 0.03, 0.006).at(z=h - 0.03)
    column = [block(0.08, 0.06, h - 0.05, 0.01).at(s * w * 0.36) for s in (-1, 1)]
    feet = [block(0.08, d - 0.05, 0.04, 0.012).at(s * w * 0.36) for s in (-1, 1)]
    return [
        finished(top, look.lacquer((0.93, 0.93, 0.92))),
        finished(joined([*column, *feet, block(w * 0.7, 0.05, 0.06).at(z=h - 0.1)]), look.steel()),
    ]


def _glass_desk(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    glass = look.dark_glass()
    bars = joined(
        [tube([(s * w * 0.42, -0.26, 0.02), (s * w * 0.3, 0.26, h - 0.02)], 0.02) for s in (-1, 1)]
        + [
            tube([(s * w * 0.42, 0.26, 0.02), (s * w * 0.3, -0.26, h - 0.02)], 0.02)
            for s in (-1, 1)
        ]
    )
    return [
        finished(block(w, d, 0.012, 0.004).at(z=h - 0.012), glass),
        finished(bars, look.chrome()),
    ]


def _tower_desk(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    top = block(w, d, 0.03, 0.006).at(z=h - 0.03)
    boards = [
        top,
        block(0.03, d, h - 0.03).at(-w / 2 + 0.02),
        block(0.03, d, 1.5).at(w / 2 - 0.02),
        block(0.3, d, 0.025).at(w / 2 - 0.16, 0, 1.1),
        block(0.3, d, 0.025).at(w / 2 - 0.16, 0, 1.48),
        block(0.03, d, 0.76).at(w / 2 - 0.32, 0, h),
    ]
    return [finished(joined(boards), look.lacquer())]


def _trestle_desk(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    trestle = joined(
        [
            tube([(s * w * 0.36 + a, y, 0), (s * w * 0.36, y * 0.8, h - 0.03)], 0.018)
            for s in (-1, 1)
            for a in (-0.14, 0.14)
            for y in (-0.25, 0.25)
        ]
    )
    return [
        finished(block(w, d, 0.035, 0.004).at(z=h - 0.035), wood),
        finished(trestle, look.lacquer()),
    ]


def _knobs(look: FinishPicker, x: float, d: float, h: float, count: int) -> Parts:
    step = (h - 0.09) / count
    made = [handle(1).at(x, -d / 2 - 0.01, 0.04 + (i + 0.5) * step) for i in range(count)]
    return [finished(joined(made), look.brass())]
