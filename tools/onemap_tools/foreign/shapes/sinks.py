"""Wash basins and kitchen sinks."""

from __future__ import annotations

from onemap_tools.foreign.finish import Finish, finished
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
from onemap_tools.foreign.shapes.kitchen import units
from onemap_tools.foreign.shapes.parts import Parts


def sink(variant: int, look: FinishPicker) -> Parts:
    """A wash basin: on a cabinet, on a pedestal, or a kitchen sink in its unit; 0.85 m high."""
    h = 0.85
    makers = (
        lambda: _pedestal_basin(look, h, variant),
        lambda: _vanity(look, h, variant),
        lambda: _kitchen_sink(look, h, variant),
        lambda: _trough(look, h),
        lambda: _pedestal_basin(look, h, variant),
        lambda: _vanity(look, h, variant),
        lambda: _kitchen_sink(look, h, variant),
        lambda: _bowl_on_table(look, h),
    )
    return makers[variant]()


def _pedestal_basin(look: FinishPicker, h: float, variant: int) -> Parts:
    white = look.ceramic()
    chrome = look.chrome()
    bowl = loft(
        [
            ring(0.3, 0.26, h - 0.16, 3),
            ring(0.56, 0.44, h - 0.02, 3),
            ring(0.58, 0.46, h, 3),
            ring(0.5, 0.38, h, 3),
            ring(0.44, 0.32, h - 0.08, 3),
            ring(0.1, 0.1, h - 0.12, 3),
        ]
    )
    foot = loft(
        [
            ring(0.24, 0.22, 0),
            ring(0.15, 0.14, 0.2),
            ring(0.16, 0.15, 0.55),
            ring(0.26, 0.22, h - 0.14),
        ]
    )
    return [
        finished(joined([bowl, foot]) if variant == 0 else bowl, white),
        finished(_tap(h, 0.17, tall=0.12), chrome),
    ]


def _vanity(look: FinishPicker, h: float, variant: int) -> Parts:
    white = look.ceramic()
    chrome = look.chrome()
    w = 0.7 if variant == 1 else 1.1
    unit = units(
        look,
        (w, 0.46, h - 0.04),
        0 if variant == 1 else 1,
        look.wood() if variant == 1 else look.lacquer(),
        upright=False,
    )
    slab = block(w + 0.02, 0.48, 0.04, 0.01).at(z=h - 0.04)
    bowls = [_vessel_bowl(0.38).at(x, -0.02, h) for x in ((0,) if variant == 1 else (-0.27, 0.27))]
    taps = [_tap(h, 0.19, tall=0.26).at(x) for x in ((0,) if variant == 1 else (-0.27, 0.27))]
    return [
        *unit,
        finished(slab, look.marble()),
        finished(joined(bowls), white),
        finished(joined(taps), chrome),
    ]


def _kitchen_sink(look: FinishPicker, h: float, variant: int) -> Parts:
    white = look.ceramic()
    chrome = look.chrome()
    w = 0.9
    unit = units(look, (w, 0.6, h), 0 if variant == 2 else 3, look.lacquer(), upright=False)
    steel = look.steel() if variant == 2 else white
    return [
        *unit,
        *_sunk(w, h + 0.04, steel),
        finished(_tap(h + 0.04, 0.24, tall=0.32), chrome),
    ]


def _trough(look: FinishPicker, h: float) -> Parts:
    trough = loft(
        [ring(0.9, 0.42, z, 12, 48) for z in (h - 0.14, h)]
        + [
            ring(0.84, 0.36, h, 12, 48),
            ring(0.8, 0.32, h - 0.1, 12, 48),
            ring(0.1, 0.1, h - 0.11, 12, 48),
        ]
    )
    return [
        finished(trough, look.marble()),
        finished(joined([_tap(h, 0.18, tall=0.14).at(x) for x in (-0.2, 0.2)]), look.brass()),
    ]


def _bowl_on_table(look: FinishPicker, h: float) -> Parts:
    white = look.ceramic()
    bowl = revolved(
        [(0.04, h - 0.2), (0.16, h - 0.16), (0.22, h), (0.2, h), (0.14, h - 0.13), (0, h - 0.15)],
        40,
    )
    table = joined(
        [
            block(0.7, 0.45, 0.04, 0.01).at(z=h - 0.24),
            *(
                block(0.05, 0.05, h - 0.24).at(sx * 0.3, sy * 0.18)
                for sx in (-1, 1)
                for sy in (-1, 1)
            ),
            block(0.64, 0.4, 0.02).at(z=0.2),
        ]
    )
    return [
        finished(table, look.wood()),
        finished(bowl, white),
        finished(_tap(h - 0.2, 0.19, tall=0.34), look.brass()),
    ]


def _vessel_bowl(width: float) -> PlainMesh:
    return revolved(
        [
            (0, 0),
            (0.3 * width, 0),
            (0.46 * width, 0.1),
            (0.5 * width, 0.13),
            (0.46 * width, 0.13),
            (0.26 * width, 0.02),
            (0, 0.02),
        ],
        36,
    )


def _sunk(w: float, h: float, steel: Finish) -> Parts:
    """A worktop with a bowl let into it and a draining board."""
    side = loft(
        [
            ring(0.42, 0.4, h, 10, 40),
            ring(0.4, 0.38, h - 0.02, 10, 40),
            ring(0.38, 0.36, h - 0.17, 10, 40),
            ring(0.05, 0.05, h - 0.18, 10, 40),
        ]
    ).at(-0.18, -0.04)
    top = [
        block(w + 0.01, 0.08, 0.03).at(0, 0.27, h - 0.03),
        block(w + 0.01, 0.06, 0.03).at(0, -0.28, h - 0.03),
        block(0.44, 0.5, 0.03).at(0.24, 0, h - 0.03),
        block(0.08, 0.5, 0.03).at(-0.42, 0, h - 0.03),
    ]
    grooves = [block(0.02, 0.36, 0.006).at(0.1 + 0.05 * i, -0.02, h) for i in range(6)]
    return [finished(joined([side, *top, *grooves]), steel)]


def _tap(z: float, y: float, tall: float) -> PlainMesh:
    """A tap whose spout bends forward."""
    spout = curve(
        [
            (0, y, z),
            (0, y, z + tall * 0.7),
            (0, y - 0.04, z + tall),
            (0, y - 0.13, z + tall * 0.95),
            (0, y - 0.15, z + tall * 0.75),
        ]
    )
    lever = tube([(0.03, y, z + 0.05), (0.08, y, z + 0.08)], 0.007)
    return joined(
        [
            tube(spout, 0.013),
            lever,
            revolved([(0, z), (0.03, z), (0.025, z + 0.03), (0, z + 0.03)], 16).at(0, y),
        ]
    )
