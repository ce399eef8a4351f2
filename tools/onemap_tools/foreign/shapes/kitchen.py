"""Ovens, and cabinets with worktops."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.finish import Finish, FinishedPart, finished
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import (
    block,
    joined,
    loft,
    revolved,
    ring,
    tube,
)
from onemap_tools.foreign.shapes.parts import Parts, front, handle, moved, plinth

COLOURS = ((0.72, 0.12, 0.12), (0.55, 0.75, 0.72), (0.93, 0.88, 0.74), (0.16, 0.24, 0.36))


def oven(variant: int, look: FinishPicker) -> Parts:
    """A cooker with an oven below a hob, or a range, 0.85 to 0.95 m high."""
    w, d, h = (0.6, 0.5, 0.9, 0.6, 0.6, 0.75, 0.6, 1.1)[variant], 0.62, look.between(0.86, 0.92)
    skins = (look.steel, look.lacquer, look.steel, look.ceramic)
    skin = (
        look.lacquer(COLOURS[int(look.rng.integers(4))])
        if variant in (2, 7)
        else skins[variant % 4]()
    )
    glass = look.dark_glass()
    parts: Parts = [
        finished(block(w, d, h - 0.03, 0.008), skin),
        finished(block(w, d, 0.03, 0.006).at(z=h - 0.03), glass if variant % 2 else skin),
    ]
    doors = 2 if w > 0.8 else 1
    step = w / doors
    for i in range(doors):
        x = (i + 0.5) * step - w / 2
        parts += [
            finished(block(step - 0.02, 0.03, 0.5, 0.01).at(x, -d / 2 - 0.012, 0.2), skin),
            finished(block(step - 0.14, 0.012, 0.3, 0.006).at(x, -d / 2 - 0.028, 0.27), glass),
            finished(
                handle(2, step * 0.75).scaled(1, 1.4, 1.4).at(x, -d / 2 - 0.025, 0.65),
                look.chrome(),
            ),
        ]
    parts.append(finished(block(w - 0.02, 0.02, 0.13, 0.006).at(0, -d / 2 - 0.006, 0.04), skin))
    parts += _hob(look, w, d, h, gas=variant % 2 == 0, knobs=4 + 2 * (doors - 1))
    if variant in (3, 5, 6):
        parts.append(finished(block(w, 0.05, 0.16, 0.01).at(0, d / 2 - 0.03, h), skin))
        parts.append(finished(block(0.16, 0.008, 0.06, 0.003).at(0, d / 2 - 0.06, h + 0.06), glass))
    return parts


def _hob(look: FinishPicker, w: float, d: float, h: float, *, gas: bool, knobs: int) -> Parts:
    """Burners with grates or glowing rings, knobs and a pot."""
    places = [(sx * w * 0.25, sy * d * 0.23) for sx in (-1, 1) for sy in (-1, 1)]
    made: Parts = []
    if gas:
        grates = [
            tube([(x - 0.09, y + t, h + 0.03), (x + 0.09, y + t, h + 0.03)], 0.006, 6)
            for x, y in places
            for t in (-0.05, 0.05)
        ]
        grates += [
            tube([(x + t, y - 0.09, h + 0.03), (x + t, y + 0.09, h + 0.03)], 0.006, 6)
            for x, y in places
            for t in (-0.05, 0.05)
        ]
        burners = [
            revolved([(0, h), (0.045, h), (0.04, h + 0.02), (0, h + 0.02)], 18).at(x, y)
            for x, y in places
        ]
        made.append(finished(joined([*grates, *burners]), look.iron()))
    else:
        rings = [
            revolved(
                [(r, h + 0.001), (r, h + 0.003), (r - 0.012, h + 0.003), (r - 0.012, h + 0.001)], 28
            ).at(x, y)
            for (x, y), r in zip(places, (0.1, 0.075, 0.075, 0.1), strict=True)
        ]
        made.append(finished(joined(rings), look.plastic((0.45, 0.2, 0.16))))
    dials = [
        revolved([(0, 0), (0.022, 0), (0.019, 0.025), (0, 0.025)], 14)
        .turned(pitch=np.pi / 2)
        .at((i + 0.5) * w / knobs - w / 2, -d / 2 - 0.01, h - 0.08)
        for i in range(knobs)
    ]
    made.append(finished(joined(dials), look.chrome()))
    x, y = places[int(look.rng.integers(4))]
    pot = revolved(
        [(0, 0), (0.1, 0), (0.105, 0.12), (0.11, 0.125), (0.1, 0.13), (0.02, 0.15), (0, 0.17)], 24
    )
    grip = tube([(x + 0.1, y, h + 0.13), (x + 0.24, y + 0.05, h + 0.14)], 0.009)
    return [*made, finished(joined([pot.at(x, y, h + 0.035), grip]), look.steel())]


def kitchen_cabinet(variant: int, look: FinishPicker) -> Parts:
    """Base units under a worktop; some with wall units and tiles above."""
    w, d, h = look.between(1.2, 1.8), 0.6, 0.9
    kind = (0, 1, 3, 0, 2, 0, 1, 0)[variant]
    body = look.wood() if variant in (2, 5) else look.lacquer()
    top = (look.wood, look.marble, look.steel)[variant % 3]()
    parts = units(look, (w, d, h - 0.04), kind, body, upright=variant % 2 == 0)
    parts.append(finished(block(w + 0.02, d + 0.03, 0.04, 0.006).at(0, -0.01, h - 0.04), top))
    if variant in (0, 1, 3, 5, 6):
        upper = units(
            look,
            (w, 0.34, 0.7),
            kind,
            body if variant != 3 else look.lacquer(),
            upright=True,
            base=False,
        )
        parts += moved(upper, 0, d / 2 - 0.17, 1.45)
    if variant in (2, 7):
        boards = joined([block(w, 0.24, 0.03).at(0, d / 2 - 0.12, z) for z in (1.4, 1.75)])
        jars = joined(
            [
                revolved([(0, 0), (0.05, 0), (0.055, 0.1), (0.04, 0.14), (0, 0.15)], 16).at(
                    x, d / 2 - 0.12, z
                )
                for z in (1.43, 1.78)
                for x in np.linspace(-w / 2 + 0.1, w / 2 - 0.1, 7)
            ]
        )
        parts += [finished(boards, look.wood()), finished(jars, look.lacquer())]
    return [*parts, *_worktop_things(look, w, h)]


def units(
    look: FinishPicker,
    size: tuple[float, float, float],
    kind: int,
    body: Finish,
    *,
    upright: bool,
    base: bool = True,
) -> Parts:
    """A row of cupboards with doors and drawers."""
    w, d, h = size
    low = 0.1 if base else 0.0
    count = max(round(w / 0.5), 2)
    step = w / count
    fronts, pulls = [], []
    for i in range(count):
        x = (i + 0.5) * step - w / 2
        if base and i % 2:
            for j in range(3):
                tall = (h - low) / 3
                fronts.append(front(step - 0.006, tall - 0.006, kind).at(x, -d / 2, low + j * tall))
                pulls.append(handle(2, 0.14).at(x, -d / 2 - 0.018, low + (j + 0.75) * tall))
        else:
            fronts.append(front(step - 0.006, h - low - 0.006, kind).at(x, -d / 2, low))
            pulls.append(
                handle(2 if kind == 0 else 1, 0.14)
                .turned(roll=np.pi / 2)
                .at(x + step * 0.36, -d / 2 - 0.018, 0.75 * h if base else 0.15)
            )
    made: list[FinishedPart] = [
        finished(block(w, d, h - low, 0.002).at(z=low), body),
        finished(joined(fronts), body, upright=upright),
        finished(joined(pulls), look.steel() if kind == 0 else look.brass()),
    ]
    if base:
        made.append(plinth(w, d, look.plastic((0.1, 0.1, 0.1)), 0.1))
    return made


def _worktop_things(look: FinishPicker, w: float, h: float) -> Parts:
    """A chopping board, jars and a bread bin."""
    board = block(0.3, 0.02, 0.22, 0.006).turned(pitch=-0.15).at(-w * 0.3, 0.24, h)
    jar = loft([ring(0.1, 0.1, z) for z in (0, 0.16)])
    jars = joined([jar.at(w * 0.2 + 0.12 * i, 0.2, h) for i in range(2)])
    return [finished(board, look.wood()), finished(jars, look.ceramic())]
