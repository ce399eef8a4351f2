"""Chairs for tables and desks."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.finish import Finish, finished
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import (
    PlainMesh,
    curve,
    cushion,
    joined,
    revolved,
    sheet,
    tube,
)
from onemap_tools.foreign.shapes.parts import Parts, legs, splayed


def chair(variant: int, look: FinishPicker) -> Parts:
    """A chair for a table or a desk: seat at 0.45 m."""
    makers = (
        _ladder_back,
        _spindle_back,
        _shell_chair,
        _cantilever,
        _padded,
        _office,
        _bentwood,
        _folding,
    )
    return makers[variant](look)


def _frame(look: FinishPicker, back: float, lean: float = 0.06) -> tuple[PlainMesh, Finish]:
    """Front legs and rear posts that rise into the back."""
    posts = []
    for s in (-1, 1):
        posts.append(
            tube(
                curve([(s * 0.2, 0.24, 0), (s * 0.2, 0.19, 0.45), (s * 0.19, 0.19 + lean, back)]),
                0.016,
            )
        )
        posts.append(tube([(s * 0.2, -0.19, 0), (s * 0.2, -0.19, 0.45)], [0.012, 0.018]))
    posts += [tube([(-0.2, y, 0.3), (0.2, y, 0.3)], 0.01) for y in (-0.19, 0.2)]
    return joined(posts), look.wood()


def _ladder_back(look: FinishPicker) -> Parts:
    rods, wood = _frame(look, 1.0)
    rungs = [
        cushion(0.4, 0.018, 0.06, 0.008).at(0, 0.2 + 0.05 * i / 3, 0.58 + 0.12 * i)
        for i in range(4)
    ]
    seat = look.wicker()
    return [
        finished(joined([rods, *rungs]), wood),
        finished(cushion(0.44, 0.42, 0.05, 0.02, puff=0.008).at(z=0.43), seat),
    ]


def _spindle_back(look: FinishPicker) -> Parts:
    hoop = curve(
        [
            (-0.2, 0.17, 0.45),
            (-0.24, 0.22, 0.7),
            (-0.15, 0.27, 0.92),
            (0, 0.28, 0.97),
            (0.15, 0.27, 0.92),
            (0.24, 0.22, 0.7),
            (0.2, 0.17, 0.45),
        ]
    )
    rods = [tube(hoop, 0.013)]
    rods += [
        tube([(x, 0.18, 0.45), (1.25 * x, 0.265, 0.93 - 1.6 * x * x)], 0.007, 8)
        for x in np.linspace(-0.14, 0.14, 7)
    ]
    seat = revolved([(0, 0.415), (0.2, 0.42), (0.225, 0.44), (0.2, 0.455), (0, 0.445)]).scaled(
        y=0.95
    )
    finish = look.wood() if look.rng.integers(2) else look.lacquer()
    return [finished(joined([*rods, seat, splayed(0.34, 0.43, 4)]), finish)]


def _shell_chair(look: FinishPicker) -> Parts:
    u, v = np.linspace(-1, 1, 17), np.linspace(0, 1, 21)
    grid = np.empty((len(v), len(u), 3))
    side = curve(
        [
            (0, -0.24, 0.43),
            (0, -0.1, 0.445),
            (0, 0.12, 0.44),
            (0, 0.2, 0.5),
            (0, 0.24, 0.65),
            (0, 0.28, 0.84),
        ],
        4,
    )
    side = side[np.linspace(0, len(side) - 1, len(v)).astype(int)]
    for i, p in enumerate(side):
        half = 0.23 - 0.05 * (v[i] - 0.4) ** 2
        grid[i, :, 0] = u * half
        grid[i, :, 1] = p[1] - 0.05 * u**2 * v[i]
        grid[i, :, 2] = p[2] + 0.05 * u**2 * (1 - v[i]) + 0.02 * v[i] * (1 - u**2)
    tone = look.one_of(look.palette.textiles + look.palette.lacquers)
    base = splayed(0.36, 0.43, 4)
    return [finished(sheet(grid), look.plastic(tone)), finished(base, look.wood())]


def _cantilever(look: FinishPicker) -> Parts:
    path = [
        (-0.22, 0.2, 0.01),
        (-0.22, -0.2, 0.012),
        (-0.22, -0.23, 0.06),
        (-0.22, -0.22, 0.42),
        (-0.22, -0.18, 0.45),
        (-0.22, 0.17, 0.44),
        (-0.22, 0.2, 0.5),
        (-0.22, 0.27, 0.85),
    ]
    left = curve(path, 5)
    right = left * (-1, 1, 1)
    bars = [tube(left, 0.012), tube(right, 0.012), tube([left[0], right[0]], 0.012)]
    pads = joined(
        [
            cushion(0.42, 0.4, 0.04, 0.018).at(0, -0.02, 0.43),
            cushion(0.42, 0.28, 0.035, 0.016).turned(pitch=1.4).at(0, 0.25, 0.7),
        ]
    )
    return [finished(joined(bars), look.chrome()), finished(pads, look.leather())]


def _padded(look: FinishPicker) -> Parts:
    cover = look.cloth()
    soft = [
        cushion(0.47, 0.46, 0.11, 0.045, puff=0.02).at(z=0.37),
        cushion(0.46, 0.55, 0.09, 0.04, puff=0.015).turned(pitch=1.44).at(0, 0.23, 0.72),
    ]
    return [finished(joined(soft), cover), finished(legs(0.46, 0.46, 0.4, 1), look.wood())]


def _office(look: FinishPicker) -> Parts:
    mesh = look.cloth((0.12, 0.12, 0.13)) if look.rng.integers(2) else look.cloth()
    soft = [
        cushion(0.5, 0.48, 0.09, 0.04, puff=0.02).at(z=0.44),
        cushion(0.46, 0.6, 0.07, 0.03, puff=0.03).turned(pitch=1.48).at(0, 0.24, 0.86),
    ]
    star = [
        tube([(0, 0, 0.1), (0.3 * np.cos(a), 0.3 * np.sin(a), 0.06)], [0.026, 0.018])
        for a in np.arange(5) * 2 * np.pi / 5 + 0.3
    ]
    wheels = [
        revolved([(0, 0), (0.028, 0.003), (0.028, 0.037), (0, 0.04)], 12)
        .turned(pitch=np.pi / 2)
        .at(0.3 * np.cos(a), 0.3 * np.sin(a) + 0.02, 0.03)
        for a in np.arange(5) * 2 * np.pi / 5 + 0.3
    ]
    arms = [
        tube(curve([(s * 0.2, 0.05, 0.47), (s * 0.29, 0.05, 0.5), (s * 0.29, 0.03, 0.66)]), 0.015)
        for s in (-1, 1)
    ]
    arms += [cushion(0.06, 0.26, 0.03, 0.012).at(s * 0.29, 0, 0.66) for s in (-1, 1)]
    column = tube([(0, 0, 0.08), (0, 0, 0.45)], 0.03)
    black = look.plastic((0.08, 0.08, 0.085))
    return [
        finished(joined(soft), mesh),
        finished(
            joined([*star, *wheels, *arms, column, tube([(0, 0.2, 0.46), (0, 0.28, 0.6)], 0.02)]),
            black,
        ),
    ]


def _bentwood(look: FinishPicker) -> Parts:
    outer = curve(
        [
            (-0.19, 0.23, 0),
            (-0.18, 0.18, 0.45),
            (-0.17, 0.24, 0.75),
            (0, 0.28, 0.9),
            (0.17, 0.24, 0.75),
            (0.18, 0.18, 0.45),
            (0.19, 0.23, 0),
        ],
        8,
    )
    inner = curve(
        [
            (-0.1, 0.18, 0.46),
            (-0.1, 0.24, 0.68),
            (0, 0.265, 0.8),
            (0.1, 0.24, 0.68),
            (0.1, 0.18, 0.46),
        ],
        8,
    )
    rods = [tube(outer, 0.014), tube(inner, 0.011)]
    rods += [tube([(s * 0.18, -0.19, 0), (s * 0.16, -0.14, 0.45)], [0.012, 0.017]) for s in (-1, 1)]
    hoop = tube(
        [(0.15 * np.cos(a), 0.15 * np.sin(a), 0.24) for a in np.linspace(0, 2 * np.pi, 25)],
        0.009,
        8,
    )
    rim = tube(
        [(0.2 * np.cos(a), 0.2 * np.sin(a), 0.45) for a in np.linspace(0, 2 * np.pi, 33)], 0.017
    )
    return [
        finished(joined([*rods, hoop, rim]), look.wood()),
        finished(revolved([(0, 0.445), (0.195, 0.445), (0.195, 0.46), (0, 0.455)]), look.wicker()),
    ]


def _folding(look: FinishPicker) -> Parts:
    bars = []
    for s in (-1, 1):
        bars.append(tube([(s * 0.22, -0.24, 0), (s * 0.21, 0.24, 0.84)], 0.011))
        bars.append(tube([(s * 0.19, 0.28, 0), (s * 0.19, -0.16, 0.45)], 0.011))
    seat = [
        cushion(0.38, 0.36, 0.025, 0.01).at(0, -0.02, 0.44),
        cushion(0.42, 0.02, 0.16, 0.008).turned(pitch=-0.5).at(0, 0.17, 0.68),
    ]
    tone = look.lacquer()
    return [finished(joined(bars), look.iron()), finished(joined(seat), tone)]
