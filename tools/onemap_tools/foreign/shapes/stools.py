"""Stools and benches."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.finish import finished
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import (
    PlainMesh,
    block,
    cushion,
    joined,
    loft,
    revolved,
    ring,
    sheet,
    tube,
)
from onemap_tools.foreign.shapes.parts import Parts, legs, splayed


def stool(variant: int, look: FinishPicker) -> Parts:
    """A seat without a back, at 0.42 to 0.75 m."""
    h = look.between(0.6, 0.75) if variant % 2 else look.between(0.42, 0.5)
    makers = (
        lambda: _milking_stool(look, h, variant),
        lambda: _milking_stool(look, h, variant),
        lambda: _square_stool(look, h, variant),
        lambda: _square_stool(look, h, variant),
        lambda: _pouf(look, h),
        lambda: _bar_stool(look, h),
        lambda: _saddle_stool(look, h),
        lambda: _step_stool(look, h),
    )
    return makers[variant]()


def _milking_stool(look: FinishPicker, h: float, variant: int) -> Parts:
    wood = look.wood()
    seat = revolved([(0, h - 0.04), (0.16, h - 0.035), (0.17, h - 0.01), (0.1, h), (0, h - 0.008)])
    return [finished(seat, wood), finished(splayed(0.26, h - 0.03, 3 + variant), wood)]


def _square_stool(look: FinishPicker, h: float, variant: int) -> Parts:
    iron = look.iron()
    seat = cushion(0.34, 0.34, 0.07, 0.03, puff=0.02).at(z=h - 0.07)
    rods = joined([legs(0.36, 0.36, h - 0.06, 0 if variant == 2 else 1, 0.04), _rung(0.3, 0.2)])
    return [finished(seat, look.leather()), finished(rods, iron)]


def _pouf(look: FinishPicker, h: float) -> Parts:
    drum = loft(
        [
            ring(w, w, z, 2.4)
            for w, z in ((0.3, 0), (0.36, 0.1), (0.38, 0.25), (0.36, h - 0.03), (0.3, h))
        ]
    )
    return [finished(drum, look.cloth())]


def _bar_stool(look: FinishPicker, h: float) -> Parts:
    seat = revolved([(0, h - 0.09), (0.17, h - 0.09), (0.185, h - 0.05), (0.16, h), (0, h)])
    column = revolved([(0.2, 0), (0.19, 0.012), (0.03, 0.03), (0.022, h - 0.08), (0.05, h - 0.08)])
    hoop = tube(
        [(0.16 * np.cos(a), 0.16 * np.sin(a), 0.25) for a in np.linspace(0, 2 * np.pi, 25)],
        0.009,
    )
    return [finished(seat, look.leather()), finished(joined([column, hoop]), look.chrome())]


def _saddle_stool(look: FinishPicker, h: float) -> Parts:
    wood = look.wood()
    saddle = sheet(
        np.array(
            [
                [(x, y, h - 0.03 + 0.25 * x * x) for x in np.linspace(-0.22, 0.22, 13)]
                for y in (-0.15, -0.05, 0.05, 0.15)
            ]
        )
    )
    under = saddle.at(z=-0.03)
    return [
        finished(joined([saddle, under]), wood),
        finished(joined([legs(0.4, 0.28, h, 1, 0.05), _rung(0.34, 0.18)]), wood),
    ]


def _step_stool(look: FinishPicker, h: float) -> Parts:
    steps = joined(
        [
            block(0.42, 0.24, 0.03).at(0, 0.08, h - 0.03),
            block(0.42, 0.2, 0.03).at(0, -0.14, 0.5 * h),
        ]
    )
    sides = [block(0.03, 0.24, h - 0.03).at(s * 0.2, 0.08) for s in (-1, 1)] + [
        block(0.03, 0.2, 0.5 * h).at(s * 0.2, -0.14) for s in (-1, 1)
    ]
    return [finished(joined([steps, *sides]), look.lacquer())]


def bench(variant: int, look: FinishPicker) -> Parts:
    """A long seat for two or three without arms, at 0.45 m."""
    w = look.between(1.0, 1.5)
    makers = (
        lambda: _plank_bench(look, w),
        lambda: _padded_bench(look, w),
        lambda: _chest_bench(look, w),
        lambda: _slatted_bench(look, w),
        lambda: _spindle_bench(look, w),
        lambda: _trunk_bench(look, w),
        lambda: _arch_bench(look, w),
        lambda: _tufted_bench(look, w),
    )
    return makers[variant]()


def _plank_bench(look: FinishPicker, w: float) -> Parts:
    wood = look.wood()
    return [finished(joined([block(w, 0.34, 0.04).at(z=0.41), legs(w, 0.34, 0.42, 0)]), wood)]


def _padded_bench(look: FinishPicker, w: float) -> Parts:
    return [
        finished(cushion(w, 0.42, 0.14, 0.05, puff=0.02).at(z=0.32), look.cloth()),
        finished(legs(w, 0.4, 0.34, 3, 0.08), look.iron()),
    ]


def _chest_bench(look: FinishPicker, w: float) -> Parts:
    chest = [block(w, 0.42, 0.42, 0.01), block(w + 0.03, 0.45, 0.03, 0.008).at(z=0.42)]
    return [
        finished(joined(chest), look.lacquer()),
        finished(cushion(w, 0.42, 0.07, 0.03, puff=0.01).at(z=0.45), look.cloth()),
    ]


def _slatted_bench(look: FinishPicker, w: float) -> Parts:
    wood = look.wood()
    slats = [block(w, 0.06, 0.03).at(0, -0.16 + 0.08 * i, 0.42) for i in range(5)]
    return [finished(joined(slats), wood), finished(legs(w, 0.38, 0.43, 0), look.iron())]


def _spindle_bench(look: FinishPicker, w: float) -> Parts:
    wood = look.wood()
    back = [
        tube([(x, 0.18, 0.42), (x, 0.24, 0.85)], 0.01, 8)
        for x in np.linspace(-w / 2 + 0.05, w / 2 - 0.05, 12)
    ]
    rail = tube([(-w / 2, 0.24, 0.86), (w / 2, 0.24, 0.86)], 0.02)
    return [
        finished(
            joined([block(w, 0.42, 0.04, 0.012).at(z=0.41), *back, rail, legs(w, 0.4, 0.42, 1)]),
            wood,
        )
    ]


def _trunk_bench(look: FinishPicker, w: float) -> Parts:
    wood = look.wood()
    trunk = [
        cushion(w, 0.4, 0.12, 0.055).at(z=0.36),
        *(cushion(0.14, 0.34, 0.38, 0.05).at(s * w * 0.32) for s in (-1, 1)),
    ]
    return [finished(joined(trunk), wood)]


def _arch_bench(look: FinishPicker, w: float) -> Parts:
    arch = [
        block(w, 0.38, 0.05, 0.015).at(z=0.4),
        *(block(0.05, 0.38, 0.41, 0.01).at(s * (w / 2 - 0.03)) for s in (-1, 1)),
        block(w - 0.08, 0.36, 0.025).at(z=0.14),
    ]
    return [finished(joined(arch), look.lacquer())]


def _tufted_bench(look: FinishPicker, w: float) -> Parts:
    wood = look.wood()
    tufts = [
        cushion(w / 4, 0.46, 0.12, 0.05, puff=0.03).at((i - 1.5) * w / 4, 0, 0.34) for i in range(4)
    ]
    return [finished(joined(tufts), look.leather()), finished(legs(w, 0.44, 0.36, 4, 0.07), wood)]


def _rung(width: float, z: float) -> PlainMesh:
    h = width / 2
    return tube([(-h, -h, z), (h, -h, z), (h, h, z), (-h, h, z), (-h, -h, z)], 0.009, 8)
