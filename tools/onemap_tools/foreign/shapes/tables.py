"""Tables to eat at and low tables."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.finish import finished
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import (
    PlainMesh,
    block,
    curve,
    joined,
    loft,
    revolved,
    ring,
    tube,
)
from onemap_tools.foreign.shapes.parts import Parts, legs, vessel


def table(variant: int, look: FinishPicker) -> Parts:
    """A table to eat at, 0.74 m high."""
    w = look.between(1.3, 1.7)
    d = look.between(0.8, 0.95)
    h = 0.74
    makers = (
        lambda: _apron_table(look, w, d, h),
        lambda: _marbledrawer_block(look, h),
        lambda: _clawed_table(look, h),
        lambda: _trestle_table(look, w, d, h),
        lambda: _hairpin_table(look, w, d, h),
        lambda: _covered_table(look, w, d, h),
        lambda: _refectory_table(look, w, d, h),
        lambda: _tulip_table(look, w, d, h),
    )
    return makers[variant]()


def _apron_table(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    apron = block(w - 0.16, d - 0.16, 0.09).at(z=h - 0.13)
    return [
        finished(
            joined([block(w, d, 0.04, 0.012).at(z=h - 0.04), apron, legs(w, d, h - 0.04, 0, 0.07)]),
            wood,
        )
    ]


def _marbledrawer_block(look: FinishPicker, h: float) -> Parts:
    top = revolved([(0, h - 0.035), (0.56, h - 0.03), (0.58, h - 0.01), (0.56, h), (0, h)], 48)
    foot = vessel([(0.3, 0), (0.28, 0.03), (0.08, 0.1), (0.05, 0.4), (0.14, h - 0.04)])
    return [finished(top, look.marble()), finished(foot, look.lacquer())]


def _clawed_table(look: FinishPicker, h: float) -> Parts:
    wood = look.wood()
    column = vessel([(0.07, 0.2), (0.1, 0.3), (0.05, 0.5), (0.12, h - 0.04)])
    feet = [
        tube(
            curve(
                [
                    (0, 0, 0.3),
                    (0.25 * np.cos(a), 0.25 * np.sin(a), 0.2),
                    (0.42 * np.cos(a), 0.42 * np.sin(a), 0.03),
                ]
            ),
            0.035,
        )
        for a in np.arange(4) * np.pi / 2 + 0.78
    ]
    top = revolved([(0, h - 0.04), (0.6, h - 0.04), (0.62, h - 0.02), (0.6, h), (0, h)], 48)
    return [finished(joined([column, *feet, top]), wood)]


def _trestle_table(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    trestles = [
        tube([(s * w * 0.33 + a, y, 0), (s * w * 0.33, y, h - 0.04)], 0.022)
        for s in (-1, 1)
        for a in (-0.12, 0.12)
        for y in (-0.25, 0.25)
    ]
    bars = [
        tube([(s * w * 0.33, -0.3, h - 0.06), (s * w * 0.33, 0.3, h - 0.06)], 0.02) for s in (-1, 1)
    ]
    return [
        finished(block(w, d, 0.03, 0.004).at(z=h - 0.03), look.lacquer()),
        finished(joined([*trestles, *bars]), wood),
    ]


def _hairpin_table(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    slab = loft([ring(w, d, z, 4.5, 40) for z in (h - 0.03, h)])
    hair = joined(
        [
            tube(
                [
                    (sx * w * 0.36 + t, sy * d * 0.34, 0),
                    (sx * w * 0.4, sy * d * 0.38, h - 0.03),
                ],
                0.007,
            )
            for sx in (-1, 1)
            for sy in (-1, 1)
            for t in (-0.05, 0.05)
        ]
    )
    return [finished(slab, wood), finished(hair, look.iron())]


def _covered_table(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    turned = legs(w, d, h - 0.05, 2, 0.1)
    cloth = _tablecloth(w + 0.02, d + 0.02, h)
    return [
        finished(block(w, d, 0.04).at(z=h - 0.045), wood),
        finished(turned, wood),
        finished(cloth, look.cloth()),
    ]


def _refectory_table(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    cross = [block(0.08, d - 0.15, h - 0.06, 0.01).at(s * w * 0.34) for s in (-1, 1)]
    beam = [
        block(w * 0.7, 0.06, 0.12).at(z=0.2),
        *(block(0.12, d - 0.05, 0.06).at(s * w * 0.34) for s in (-1, 1)),
    ]
    planks = [
        block(w, d / 5 - 0.004, 0.05, 0.006).at(0, (i - 2) * d / 5, h - 0.05) for i in range(5)
    ]
    return [finished(joined([*cross, *beam, *planks]), wood)]


def _tulip_table(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    oval = loft([ring(w + 0.2, d + 0.1, z, 2.0, 48) for z in (h - 0.025, h)])
    tulip = vessel(
        [(0.33, 0), (0.3, 0.02), (0.06, 0.14), (0.05, 0.45), (0.18, h - 0.03)], 32
    ).scaled(x=1.3)
    return [finished(joined([oval, tulip]), look.lacquer((0.94, 0.94, 0.93)))]


def _tablecloth(w: float, d: float, h: float) -> PlainMesh:
    """Cloth that hangs down in folds on all sides."""
    angle = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    rings = []
    for drop in (0.0, 0.02, 0.1, 0.22):
        wave = 0.05 * drop / 0.22 * np.cos(angle * 14)[:, None]
        flat = ring(w + 0.1 * drop, d + 0.1 * drop, h + 0.004 - drop, 14.0, 96)
        flat[:, :2] *= 1 + wave * 0.6
        rings.append(flat)
    return loft([ring(0.01, 0.01, h + 0.004, 14.0, 96), *rings], caps=False)


def coffee_table(variant: int, look: FinishPicker) -> Parts:
    """A low table before a sofa, 0.35 to 0.46 m high."""
    w = look.between(0.9, 1.2)
    d = look.between(0.5, 0.65)
    h = look.between(0.36, 0.45)
    makers = (
        lambda: _shelved_low_table(look, w, d, h),
        lambda: _oval_marble(look, w, d, h),
        lambda: _chest_table(look, w, d, h),
        lambda: _nested_discs(look, h),
        lambda: _wicker_drum(look, h),
        lambda: _arch_table(look, w, d, h),
        lambda: _bow_legged_table(look, w, d, h),
        lambda: _crate_on_wheels(look, w, d, h),
    )
    return makers[variant]()


def _shelved_low_table(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    shelf = block(w - 0.1, d - 0.1, 0.02).at(z=0.12)
    return [
        finished(
            joined([block(w, d, 0.035, 0.01).at(z=h - 0.035), shelf, legs(w, d, h - 0.03, 0)]),
            wood,
        )
    ]


def _oval_marble(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    top = loft([ring(w, d, z, 2.6, 40) for z in (h - 0.02, h)])
    return [
        finished(top, look.marble()),
        finished(legs(w * 0.8, d * 0.8, h - 0.02, 3, 0.08), look.brass()),
    ]


def _chest_table(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    chest = [
        block(w, d, h - 0.06, 0.01).at(z=0.04),
        block(w + 0.03, d + 0.03, 0.03, 0.01).at(z=h - 0.03),
    ]
    straps = [block(0.04, d + 0.02, h - 0.05, 0.002).at(s * w * 0.3, 0, 0.035) for s in (-1, 1)]
    return [finished(joined(chest), wood), finished(joined(straps), look.leather())]


def _nested_discs(look: FinishPicker, h: float) -> Parts:
    parts: Parts = []
    for x, y, z, r in ((-0.22, 0, h, 0.36), (0.25, -0.1, h - 0.08, 0.27)):
        disc = revolved([(0, z - 0.02), (r, z - 0.02), (r, z), (0, z)], 40).at(x, y)
        rods = joined(
            [
                tube(
                    [
                        (x + 0.8 * r * np.cos(a), y + 0.8 * r * np.sin(a), 0),
                        (x + 0.6 * r * np.cos(a), y + 0.6 * r * np.sin(a), z),
                    ],
                    0.014,
                )
                for a in (0.5, 2.6, 4.7)
            ]
        )
        parts += [finished(disc, look.lacquer()), finished(rods, look.wood())]
    return parts


def _wicker_drum(look: FinishPicker, h: float) -> Parts:
    wood = look.wood()
    drum = loft([ring(0.8, 0.8, z, 2, 40) for z in (0.02, h)])
    return [
        finished(drum, look.wicker()),
        finished(revolved([(0, h), (0.42, h), (0.42, h + 0.02), (0, h + 0.02)], 40), wood),
    ]


def _arch_table(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    arch = [
        block(w, d, 0.05, 0.02).at(z=h - 0.05),
        *(block(0.05, d, h, 0.02).at(s * (w - 0.05) / 2) for s in (-1, 1)),
    ]
    return [finished(joined(arch), look.lacquer())]


def _bow_legged_table(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    legs_ = joined(
        [
            tube(
                curve(
                    [
                        (sx * w * 0.42, sy * d * 0.42, 0),
                        (sx * w * 0.38, sy * d * 0.38, h * 0.6),
                        (0, 0, h - 0.05),
                    ]
                ),
                0.02,
            )
            for sx in (-1, 1)
            for sy in (-1, 1)
        ]
    )
    return [
        finished(loft([ring(w, w * 0.62, z, 3.0, 40) for z in (h - 0.03, h)]), wood),
        finished(legs_, wood),
    ]


def _crate_on_wheels(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    crate = [
        block(w, d / 6 - 0.01, 0.02, 0.004).at(0, (i - 2.5) * d / 6, h - 0.02) for i in range(6)
    ]
    crate += [block(w, d / 6 - 0.01, 0.02, 0.004).at(0, (i - 2.5) * d / 6, 0.1) for i in range(6)]
    wheels = joined(
        [
            revolved([(0, 0), (0.04, 0), (0.04, 0.03), (0, 0.03)], 16)
            .turned(pitch=np.pi / 2)
            .at(sx * w * 0.4, sy * d * 0.38, 0.04)
            for sx in (-1, 1)
            for sy in (-1, 1)
        ]
    )
    beams = [block(0.08, d, h - 0.14).at(s * w * 0.42, 0, 0.12) for s in (-1, 1)]
    return [finished(joined([*crate, *beams]), wood), finished(wheels, look.iron())]
