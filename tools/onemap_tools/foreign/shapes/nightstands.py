"""Night tables."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.finish import finished
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import (
    PlainMesh,
    block,
    joined,
    loft,
    revolved,
    ring,
    tube,
)
from onemap_tools.foreign.shapes.parts import (
    Parts,
    drawer_block,
    front,
    handle,
    legs,
    moved,
)


def nightstand(variant: int, look: FinishPicker) -> Parts:
    """A small table or chest beside a bed, 0.45 to 0.6 m high."""
    w = look.between(0.4, 0.5)
    d = look.between(0.36, 0.42)
    h = look.between(0.46, 0.6)
    makers = (
        lambda: _legged_chest(look, w, d, h),
        lambda: _turned_stand(look, w, d, h),
        lambda: _brass_discs(look, h),
        lambda: _open_cube(look, w, d, h),
        lambda: _drum_cabinet(look, h),
        lambda: _panelled_cabinet(look, w, d, h),
        lambda: _wicker_stand(look, w, d, h),
        lambda: _drawer_cube(look, w, d, h),
    )
    return makers[variant]()


def _legged_chest(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    box = drawer_block(w, d, h - 0.12, 2, 0).at(z=0.12)
    pulls = joined(
        [handle(2, 0.14).at(0, -d / 2 - 0.02, z) for z in (0.12 + 0.28 * h, 0.12 + 0.62 * h)]
    )
    return [
        finished(joined([box, legs(w, d, 0.13, 1, 0.05)]), wood),
        finished(pulls, look.iron()),
    ]


def _turned_stand(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    shelf = joined(
        [
            block(w, d, 0.03).at(z=h - 0.03),
            block(w - 0.04, d - 0.04, 0.02).at(z=0.14),
            legs(w, d, h - 0.02, 2, 0.05),
        ]
    )
    drawer = front(w - 0.12, 0.12, 0).at(0, -d / 2 + 0.02, h - 0.16)
    return [
        finished(
            joined([shelf, block(w - 0.08, d - 0.06, 0.13).at(z=h - 0.16), drawer]),
            look.lacquer(),
        ),
        finished(handle(1).at(0, -d / 2, h - 0.1), look.brass()),
    ]


def _brass_discs(look: FinishPicker, h: float) -> Parts:
    disc = [revolved([(0, z - 0.02), (0.22, z - 0.02), (0.22, z), (0, z)], 32) for z in (0.18, h)]
    return [finished(joined([*disc, *_rods(0.2, h)]), look.brass())]


def _open_cube(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    box = (
        [block(w, d, 0.02).at(z=z) for z in (0.0, h * 0.45, h - 0.02)]
        + [block(0.02, d, h).at(s * (w / 2 - 0.01)) for s in (-1, 1)]
        + [block(w, 0.01, h).at(0, d / 2 - 0.005)]
    )
    books = joined(
        [
            block(0.16, 0.22, 0.025, 0.002)
            .turned(yaw=0.2 * i)
            .at(0, 0, h * 0.45 + 0.02 + 0.026 * i)
            for i in range(3)
        ]
    )
    return [finished(joined(box), wood), finished(books, look.cloth())]


def _drum_cabinet(look: FinishPicker, h: float) -> Parts:
    drum = loft([ring(0.42, 0.42, z, 2) for z in (0.0, h)])
    seam = front(0.2, h - 0.1, 3).at(0, -0.2, 0.05)
    return [
        finished(joined([drum, seam]), look.lacquer()),
        finished(handle(1).at(0.07, -0.22, h / 2), look.brass()),
    ]


def _panelled_cabinet(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    cabinet = joined(
        [
            block(w, d, h - 0.06, 0.012).at(z=0.06),
            front(w - 0.04, h - 0.12, 2).at(0, -d / 2, 0.09),
            legs(w, d, 0.07, 4, 0.05),
        ]
    )
    return [
        finished(cabinet, wood),
        finished(handle(1).at(w / 2 - 0.07, -d / 2 - 0.02, h / 2), look.brass()),
    ]


def _wicker_stand(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    wood = look.wood()
    basket = loft([ring(w, d, z, 5, 40) for z in (0.0, h - 0.03)])
    return [
        finished(basket, look.wicker()),
        finished(loft([ring(w + 0.02, d + 0.02, z, 5, 40) for z in (h - 0.03, h)]), wood),
    ]


def _drawer_cube(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    cubes = drawer_block(w, d, h, 3, 0)
    return [
        finished(cubes, look.lacquer()),
        *moved(
            [finished(handle(3).at(0, 0, z), look.chrome()) for z in (0.2 * h, 0.5 * h, 0.82 * h)],
            0,
            -d / 2 - 0.018,
        ),
    ]


def _rods(radius: float, height: float) -> list[PlainMesh]:
    return [
        tube(
            [
                (radius * np.cos(a), radius * np.sin(a), 0),
                (radius * np.cos(a), radius * np.sin(a), height),
            ],
            0.008,
        )
        for a in (0.5, 2.6, 4.7)
    ]
