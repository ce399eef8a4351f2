"""Sofas and armchairs: rolled arms, blocks, tufted leather, corners, wooden frames, curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F64
from onemap_tools.foreign.finish import Finish, finished
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import (
    PlainMesh,
    block,
    curve,
    cushion,
    joined,
    loft,
    sheet,
    tube,
)
from onemap_tools.foreign.shapes.parts import Parts, legs


@dataclass(frozen=True, slots=True)
class Upholstered:
    """Sizes in metres of a seat with arms and a back; ``seats`` cushions."""

    width: float
    depth: float
    seat: float
    back: float
    arm: float
    arm_height: float
    seats: int
    feet: float = 0.12


def sofa(variant: int, look: FinishPicker) -> Parts:
    """A sofa for two to four, about 0.9 m deep."""
    w = look.between(1.75, 2.35)
    makers = (
        lambda: _rolled(Upholstered(w, 0.95, 0.46, 0.88, 0.2, 0.62, 3), look.cloth(), look),
        lambda: _blocks(Upholstered(w, 1.0, 0.4, 0.72, 0.24, 0.5, 2, 0.1), look.cloth(), look, 3),
        lambda: _tufted(Upholstered(w, 0.9, 0.44, 0.74, 0.2, 0.74, 3), look.leather(), look),
        lambda: _corner(Upholstered(2.5, 0.95, 0.42, 0.8, 0.2, 0.58, 3, 0.06), look.cloth(), look),
        lambda: _wooden(
            Upholstered(0.9 * w, 0.85, 0.42, 0.8, 0.07, 0.6, 3, 0.2), look.cloth(), look
        ),
        lambda: _curved(w - 0.1, look.cloth(), look),
        lambda: _winged(
            Upholstered(1.55, 0.85, 0.45, 1.0, 0.12, 0.66, 2, 0.16), look.cloth(), look
        ),
        lambda: _blocks(
            Upholstered(w, 0.92, 0.44, 0.84, 0.12, 0.66, 3, 0.14), look.leather(), look, 1
        ),
    )
    return makers[variant]()


def armchair(variant: int, look: FinishPicker) -> Parts:
    """An upholstered chair for one, with arms or a shell."""
    makers = (
        lambda: _rolled(Upholstered(0.95, 0.92, 0.45, 0.9, 0.19, 0.63, 1), look.cloth(), look),
        lambda: _blocks(
            Upholstered(0.88, 0.85, 0.42, 0.74, 0.16, 0.58, 1, 0.12), look.cloth(), look, 0
        ),
        lambda: _winged(Upholstered(0.78, 0.85, 0.45, 1.1, 0.1, 0.64, 1, 0.18), look.cloth(), look),
        lambda: _wooden(
            Upholstered(0.74, 0.82, 0.42, 0.86, 0.06, 0.6, 1, 0.22), look.cloth(), look
        ),
        lambda: _tub(look.cloth(), look, 0.78),
        lambda: _lounge(look.leather(), look),
        lambda: _tufted(Upholstered(0.95, 0.88, 0.44, 0.76, 0.18, 0.76, 1), look.leather(), look),
        lambda: _egg(look.cloth(), look),
    )
    return makers[variant]()


def _seats(size: Upholstered, puff: float = 0.03) -> PlainMesh:
    """The loose seat cushions side by side."""
    inside = size.width - 2 * size.arm
    one = inside / size.seats
    made = [
        cushion(one - 0.01, size.depth - 0.22, 0.16, 0.05, puff=puff).at(
            (i + 0.5) * one - inside / 2, -0.11, size.seat - 0.16
        )
        for i in range(size.seats)
    ]
    return joined(made)


def _backs(size: Upholstered, count: int, lean: float = 0.2) -> PlainMesh:
    """Loose back cushions that lean backwards."""
    inside = size.width - 2 * size.arm
    one = inside / count
    height = size.back - size.seat + 0.06
    pillow = cushion(one - 0.02, height, 0.17, 0.06, puff=0.05).turned(pitch=np.pi / 2)
    made = [
        pillow.at(0, 0.085, height / 2)
        .turned(pitch=-lean)
        .at((i + 0.5) * one - inside / 2, size.depth / 2 - 0.33, size.seat - 0.03)
        for i in range(count)
    ]
    return joined(made)


def _rolled(size: Upholstered, cover: Finish, look: FinishPicker) -> Parts:
    """Arms that roll outwards, a rounded high back, a skirt down to the floor."""
    parts = [
        cushion(size.width - 0.1, size.depth - 0.06, size.seat - 0.16, 0.03).at(z=0.03),
        cushion(size.width - 0.2, 0.24, size.back - 0.05, 0.11, puff=0.01).at(
            0, size.depth / 2 - 0.14, 0.05
        ),
        _seats(size),
        _backs(size, size.seats, 0.12),
    ]
    for side in (-1, 1):
        x = side * (size.width / 2 - size.arm / 2)
        roll = tube(
            curve(
                [
                    (x + side * 0.02, -size.depth / 2, size.arm_height - 0.09),
                    (x + side * 0.02, 0, size.arm_height - 0.09),
                    (x, size.depth / 2 - 0.06, size.arm_height - 0.04),
                ]
            ),
            0.115,
            18,
        )
        parts += [
            roll,
            cushion(size.arm * 0.7, size.depth - 0.04, size.arm_height - 0.12, 0.03).at(x, 0, 0.03),
        ]
    feet = legs(size.width - 0.2, size.depth - 0.2, 0.05, 0)
    return [finished(joined(parts), cover), finished(feet, look.wood())]


def _blocks(size: Upholstered, cover: Finish, look: FinishPicker, leg: int) -> Parts:
    """Plain bevelled blocks: low arms, straight back, thin legs."""
    low = size.feet
    parts = [
        cushion(size.width - 0.02, size.depth, size.seat - 0.14 - low, 0.03).at(z=low),
        cushion(size.width - 2 * size.arm, 0.18, size.back - low - 0.06, 0.05).at(
            0, size.depth / 2 - 0.1, low
        ),
        _seats(size, 0.015),
        _backs(size, max(size.seats, 1), 0.16),
    ]
    parts += [
        cushion(size.arm, size.depth, size.arm_height - low, 0.04, puff=0.006).at(
            s * (size.width - size.arm) / 2, 0, low
        )
        for s in (-1, 1)
    ]
    feet = legs(size.width - 0.1, size.depth - 0.1, low + 0.02, leg, 0.07)
    return [
        finished(joined(parts), cover),
        finished(feet, look.iron() if leg == 3 else look.wood()),
    ]


def _tufted(size: Upholstered, cover: Finish, look: FinishPicker) -> Parts:
    """One roll for arms and back at the same height, with buttons sunk in a lattice."""
    x, y = size.width / 2 - 0.1, size.depth / 2 - 0.1
    top = size.back - 0.1
    rail = curve(
        [
            (-x, -y - 0.06, top),
            (-x, 0, top),
            (-x + 0.02, y - 0.04, top),
            (-x + 0.16, y, top),
            (0, y, top),
            (x - 0.16, y, top),
            (x - 0.02, y - 0.04, top),
            (x, 0, top),
            (x, -y - 0.06, top),
        ],
        8,
    )

    def buttons(v: F64) -> F64:
        """Sink the inner side of the back where the lattice has its buttons."""
        across = np.abs(np.sin(v[:, 0] / 0.2 * np.pi)) * np.abs(np.sin(v[:, 2] / 0.16 * np.pi))
        v[:, 1] += 0.035 * (1 - across) * (v[:, 1] < 0)
        return v

    steps_x, steps_z = 64, 14
    xs, zs = np.linspace(-x + 0.06, x - 0.06, steps_x), np.linspace(0.3, top, steps_z)
    grid = np.stack([*np.meshgrid(xs, zs, indexing="ij")], axis=-1)
    quilt = np.stack([grid[..., 0], np.full(grid.shape[:2], -0.05), grid[..., 1]], axis=-1)
    parts = [
        tube(rail, 0.1, 18),
        sheet(quilt).bent(buttons).at(y=y - 0.03),
        cushion(size.width - 0.1, size.depth - 0.06, size.seat - 0.24, 0.03).at(z=0.1),
        cushion(size.width - 0.2, 0.16, top - 0.1, 0.03).at(0, y, 0.1),
        *(cushion(0.16, size.depth - 0.1, top - 0.1, 0.03).at(s * x, 0, 0.1) for s in (-1, 1)),
        _seats(size, 0.02),
    ]
    return [
        finished(joined(parts), cover),
        finished(legs(size.width, size.depth, 0.12, 2, 0.12), look.wood()),
    ]


def _corner(size: Upholstered, cover: Finish, look: FinishPicker) -> Parts:
    """A sofa with a long seat at its right end."""
    long = 1.55
    main = _blocks(size, cover, look, 0)
    x = size.width / 2 - 0.45
    end = joined(
        [
            cushion(0.9, long, size.seat - 0.2, 0.03).at(x, -(long - size.depth) / 2, 0.06),
            cushion(0.88, long - 0.24, 0.17, 0.05, puff=0.03).at(
                x, -(long - size.depth) / 2 - 0.1, size.seat - 0.15
            ),
        ]
    )
    return [*main, finished(end, cover)]


def _wooden(size: Upholstered, cover: Finish, look: FinishPicker) -> Parts:
    """An open wooden frame with paddle arms, cushions laid into it."""
    sticks = [legs(size.width, size.depth - 0.06, size.seat - 0.18, 1, 0.09)]
    for s in (-1, 1):
        x = s * (size.width / 2 - 0.04)
        arm = [
            (x, -size.depth / 2, size.arm_height - 0.02),
            (x, 0, size.arm_height),
            (x, size.depth / 2 - 0.1, size.arm_height - 0.05),
        ]
        sticks.append(tube(curve(arm), 0.024, 12).scaled(x=1.0))
        sticks.append(
            tube(
                [
                    (x, -size.depth / 2 + 0.06, 0.1),
                    (x, -size.depth / 2 + 0.03, size.arm_height - 0.02),
                ],
                0.018,
            )
        )
        sticks.append(
            tube([(x, size.depth / 2 - 0.12, 0.1), (x, size.depth / 2 - 0.04, size.back)], 0.018)
        )
    for z in (size.seat - 0.05, size.back - 0.02):
        sticks.append(
            tube(
                [
                    (-size.width / 2 + 0.04, size.depth / 2 - 0.06, z),
                    (size.width / 2 - 0.04, size.depth / 2 - 0.06, z),
                ],
                0.016,
            )
        )
    sticks.append(block(size.width - 0.08, size.depth - 0.14, 0.035, 0.01).at(z=size.seat - 0.2))
    soft = [_seats(size), _backs(size, size.seats, 0.22)]
    return [finished(joined(sticks), look.wood()), finished(joined(soft), cover)]


def _curved(width: float, cover: Finish, look: FinishPicker) -> Parts:
    """A kidney: a seat and a back that follow an arc, without arms."""
    angle = np.linspace(-0.62, 0.62, 36)
    radius = width / 2 / np.sin(0.62)

    def swept(profile: F64) -> PlainMesh:
        """A closed profile (K, 2) of distance from the arc and height, along the arc."""
        ends = np.clip((0.64 - np.abs(angle)) / 0.12, 0.35, 1) ** 0.5
        middle = profile.mean(axis=0)
        rings = []
        for a, e in zip(angle, ends, strict=True):
            shape = middle + (profile - middle) * (e, 1.0 if e == 1 else 0.55 + 0.45 * e)
            r = radius + shape[:, 0]
            rings.append(np.stack([r * np.sin(a), r * np.cos(a) - radius, shape[:, 1]], axis=1))
        return loft(rings)

    t = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    seat = np.stack([-0.16 + 0.42 * np.cos(t), 0.27 + 0.17 * np.sin(t)], axis=1)
    back = np.stack([0.24 + 0.15 * np.cos(t) + 0.08 * np.sin(t), 0.5 + 0.3 * np.sin(t)], axis=1)
    base = joined([swept(seat), swept(back)])
    return [
        finished(base, cover),
        finished(legs(0.7 * width, 0.6, 0.14, 1).at(y=-0.2), look.wood()),
    ]


def _winged(size: Upholstered, cover: Finish, look: FinishPicker) -> Parts:
    """A high back with wings on slender legs."""
    low = size.feet
    height = size.back - low - 0.1
    parts = [
        cushion(size.width - 0.04, size.depth - 0.1, size.seat - low - 0.13, 0.04).at(z=low),
        cushion(size.width - 0.1, 0.16, height, 0.07, puff=0.0)
        .turned(pitch=-0.12)
        .at(0, size.depth / 2 - 0.2, low + 0.08),
        _seats(size, 0.04),
        cushion(size.width - 2 * size.arm - 0.02, height - 0.3, 0.12, 0.06, puff=0.04)
        .turned(pitch=np.pi / 2 - 0.12)
        .at(0, size.depth / 2 - 0.2, size.seat + (height - 0.3) / 2),
    ]
    for s in (-1, 1):
        x = s * (size.width / 2 - size.arm / 2)
        wing = (
            cushion(size.arm * 0.8, 0.36, 0.5, 0.05)
            .turned(pitch=-0.12)
            .at(x, size.depth / 2 - 0.3, size.back - 0.56)
        )
        parts += [
            wing,
            cushion(size.arm, size.depth - 0.1, size.arm_height - low - 0.05, 0.05).at(
                x, -0.03, low + 0.05
            ),
        ]
    return [
        finished(joined(parts), cover),
        finished(legs(size.width, size.depth, low + 0.03, 4, 0.1), look.wood()),
    ]


def _shell(width: float, low: float, seat_side: float, back: float) -> PlainMesh:
    """A rounded shell, high behind and lower in front, thick as a cushion."""
    angle = np.linspace(-2.35, 2.35, 44)
    rings = []
    for a in angle:
        top = seat_side + (back - seat_side) * np.clip((np.cos(a) + 0.55) / 1.55, 0, 1) ** 1.3
        outward = np.array([np.sin(a), np.cos(a)])
        t = np.linspace(0, 2 * np.pi, 16, endpoint=False)
        radial = width / 2 - 0.07 + 0.06 * np.cos(t)
        z = (top + low) / 2 + (top - low) / 2 * np.sign(np.sin(t)) * np.abs(np.sin(t)) ** 0.6
        rings.append(np.column_stack([radial[:, None] * outward, z]))
    return loft(rings)


def _tub(cover: Finish, look: FinishPicker, width: float) -> Parts:
    """A round tub: arms and back are one shell."""
    soft = [
        _shell(width, 0.16, 0.56, 0.78),
        cushion(width - 0.2, width - 0.16, 0.3, 0.12, puff=0.03).at(0, -0.04, 0.16),
    ]
    return [finished(joined(soft), cover), finished(legs(0.55, 0.55, 0.17, 1), look.wood())]


def _lounge(cover: Finish, look: FinishPicker) -> Parts:
    """A reclined shell of moulded wood with leather pads on a star of metal."""
    pads = joined(
        [
            cushion(0.6, 0.56, 0.12, 0.05, puff=0.03).turned(pitch=-0.12).at(0, -0.1, 0.34),
            cushion(0.58, 0.36, 0.12, 0.05, puff=0.03).turned(pitch=1.15).at(0, 0.24, 0.57),
            cushion(0.58, 0.3, 0.12, 0.05, puff=0.03).turned(pitch=1.2).at(0, 0.36, 0.86),
            *(cushion(0.08, 0.34, 0.06, 0.025).at(s * 0.37, -0.02, 0.58) for s in (-1, 1)),
        ]
    )
    shell = joined(
        [
            cushion(0.66, 0.6, 0.03, 0.014).turned(pitch=-0.12).at(0, -0.09, 0.31),
            cushion(0.64, 0.74, 0.03, 0.014).turned(pitch=1.18).at(0, 0.36, 0.68),
            *(
                tube(
                    curve([(s * 0.33, 0.1, 0.36), (s * 0.38, 0.05, 0.5), (s * 0.37, -0.02, 0.58)]),
                    0.02,
                )
                for s in (-1, 1)
            ),
        ]
    )
    star = [
        tube([(0, 0, 0.3), (0.34 * np.cos(a), 0.34 * np.sin(a), 0.02)], [0.02, 0.012])
        for a in np.arange(5) * 2 * np.pi / 5
    ]
    return [
        finished(pads, cover),
        finished(shell, look.wood()),
        finished(joined(star), look.chrome()),
    ]


def _egg(cover: Finish, look: FinishPicker) -> Parts:
    """A tall rounded shell on a swivel foot."""
    soft = [
        _shell(0.84, 0.3, 0.56, 1.12),
        cushion(0.62, 0.6, 0.2, 0.09, puff=0.03).at(0, -0.06, 0.28),
    ]
    foot = [tube([(0, 0, 0.02), (0, 0, 0.3)], 0.03)]
    foot += [
        tube([(0, 0, 0.04), (0.3 * np.cos(a), 0.3 * np.sin(a), 0.015)], [0.02, 0.014])
        for a in np.arange(4) * np.pi / 2 + 0.8
    ]
    return [finished(joined(soft), cover), finished(joined(foot), look.chrome())]
