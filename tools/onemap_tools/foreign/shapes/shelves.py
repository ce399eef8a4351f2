"""Bookcases and wall shelves full of things."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.finish import finished
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import PlainMesh, block, curve, joined, tube
from onemap_tools.foreign.shapes.parts import (
    Parts,
    books,
    corners,
    front,
    jumble,
    moved,
)

BOARD_M = 0.022


def bookcase(variant: int, look: FinishPicker) -> Parts:
    """Tall open shelves full of books and other things."""
    w, h, d = look.between(0.75, 1.1), look.between(1.7, 2.1), look.between(0.27, 0.34)
    if variant == 3:
        return _ladder_shelf(look)
    if variant == 5:
        return _metal_rack(look, w, h, d)
    finish = (look.wood, look.lacquer)[variant % 2]()
    rows = 3 if variant == 4 else 5
    if variant == 4:
        w, h = 1.5, 1.15
    columns = 2 if variant in (2, 4, 6) else 1
    if variant == 6:
        w, rows = 1.5, 5
    step_x, step_z = w / columns, (h - 0.06) / rows
    back = () if variant == 7 else (block(w, 0.008, h).at(0, d / 2 - 0.004),)
    sides = [
        block(BOARD_M, d, h).at(x) for x in np.linspace(-w / 2 + 0.011, w / 2 - 0.011, columns + 1)
    ]
    boards = [block(w, d, BOARD_M).at(z=0.04 + i * step_z) for i in range(rows + 1)]
    parts: Parts = [finished(joined([*back, *sides, *boards]), finish)]
    for row in range(rows):
        for column in range(columns):
            x, z = column * step_x - w / 2 + 0.025, 0.04 + row * step_z + BOARD_M
            if variant == 6 and row == 0:
                parts.append(
                    finished(
                        front(step_x - 0.01, step_z, 1).at(
                            x + step_x / 2 - 0.025, -d / 2, z - 0.02
                        ),
                        finish,
                    )
                )
                continue
            room = step_z - 0.05
            fill = jumble if look.rng.uniform() < 0.35 else books
            parts += moved(fill(look, step_x - 0.05, room, d - 0.04), x, -d / 2 + 0.02, z)
    return parts


def _ladder_shelf(look: FinishPicker) -> Parts:
    """Shelves of falling depth on two leaning poles."""
    rails = [tube([(s * 0.35, -0.28, 0), (s * 0.35, 0.16, 1.9)], 0.018) for s in (-1, 1)]
    posts = [tube([(s * 0.35, 0.16, 0), (s * 0.35, 0.16, 1.9)], 0.012) for s in (-1, 1)]
    parts: Parts = [finished(joined([*rails, *posts]), look.iron())]
    for i in range(5):
        z, deep = 0.15 + 0.38 * i, 0.42 - 0.07 * i
        parts.append(finished(block(0.7, deep, 0.02).at(0, 0.16 - deep / 2, z), look.wood()))
        parts += moved(
            (jumble if i % 2 else books)(look, 0.64, 0.3, deep), -0.32, 0.18 - deep, z + 0.022
        )
    return parts


def _metal_rack(look: FinishPicker, w: float, h: float, d: float) -> Parts:
    """Posts of metal with wooden boards and a crossed back."""
    posts = [block(0.03, 0.03, h, 0.002).at(x, y) for x, y in corners(w, d, 0.015)]
    cross = [
        tube([(-w / 2, d / 2, 0.1), (w / 2, d / 2, h - 0.1)], 0.004, 6),
        tube([(w / 2, d / 2, 0.1), (-w / 2, d / 2, h - 0.1)], 0.004, 6),
    ]
    parts: Parts = [finished(joined([*posts, *cross]), look.iron())]
    for i in range(5):
        z = 0.08 + i * (h - 0.12) / 4
        parts.append(finished(block(w, d, 0.028).at(z=z), look.wood()))
        if i < 4:
            parts += moved(
                (books if i % 2 else jumble)(look, w - 0.1, h / 4 - 0.09, d - 0.04),
                -w / 2 + 0.05,
                -d / 2 + 0.02,
                z + 0.03,
            )
    return parts


def shelf(variant: int, look: FinishPicker) -> Parts:
    """Boards on a wall with things on them; hung by the apartment."""
    w = look.between(0.7, 1.1)
    d = look.between(0.2, 0.26)
    makers = (
        lambda: _stacked_boards(look, w, d, variant),
        lambda: _stacked_boards(look, w, d, variant),
        lambda: _stacked_boards(look, w, d, variant),
        lambda: _cubes(look, d, variant),
        lambda: _cubes(look, d, variant),
        lambda: _roped_board(look, w, d, variant),
        lambda: _hoop_shelf(look, d, variant),
        lambda: _ledge(look, w, variant),
    )
    return makers[variant]()


def _stacked_boards(look: FinishPicker, w: float, d: float, variant: int) -> Parts:
    finish = look.wood() if variant % 2 == 0 else look.lacquer()
    count = (1, 2, 3)[variant]
    parts: Parts = []
    for i in range(count):
        z = 0.34 * i
        parts.append(finished(_bracketed(w, d, z, bracket=variant != 1), finish))
        parts += moved(
            (jumble if i % 2 == 0 else books)(look, w - 0.06, 0.28, d),
            -w / 2 + 0.03,
            -d / 2 + 0.01,
            z + 0.03,
        )
    return parts


def _cubes(look: FinishPicker, d: float, variant: int) -> Parts:
    finish = look.wood() if variant % 2 == 0 else look.lacquer()
    side, made = 0.34, []
    for i in range(2 + variant % 2):
        x = (i - 0.5) * (side + 0.02)
        made += [block(side, d, 0.02).at(x, 0, z) for z in (0, side)] + [
            block(0.02, d, side).at(x + s * side / 2) for s in (-1, 1)
        ]
    return [
        finished(joined(made), finish),
        *moved(
            books(look, side - 0.05, side - 0.05, d),
            -0.5 * (side + 0.02) - side / 2 + 0.02,
            -d / 2,
            0.02,
        ),
        *moved(
            jumble(look, side - 0.05, side - 0.08, d),
            0.5 * (side + 0.02) - side / 2 + 0.02,
            -d / 2,
            0.02,
        ),
    ]


def _roped_board(look: FinishPicker, w: float, d: float, variant: int) -> Parts:
    finish = look.wood() if variant % 2 == 0 else look.lacquer()
    ropes = [tube([(s * w * 0.42, 0, 0), (s * w * 0.42, d / 2, 0.6)], 0.006, 6) for s in (-1, 1)]
    return [
        finished(block(w, d, 0.03).at(z=-0.015), finish),
        finished(joined(ropes), look.cloth()),
        *moved(jumble(look, w - 0.2, 0.25, d), -w / 2 + 0.1, -d / 2, 0.02),
    ]


def _hoop_shelf(look: FinishPicker, d: float, variant: int) -> Parts:
    finish = look.wood() if variant % 2 == 0 else look.lacquer()
    angle = np.linspace(0, 2 * np.pi, 40)
    hoop = tube(
        np.stack([0.42 * np.cos(angle), 0 * angle, 0.42 * np.sin(angle) + 0.42], axis=1), 0.014
    )
    boards = [block(2 * np.sqrt(0.42**2 - (z - 0.42) ** 2), d, 0.02).at(z=z) for z in (0.2, 0.5)]
    return [
        finished(hoop, look.brass()),
        finished(joined(boards), finish),
        *moved(jumble(look, 0.5, 0.2, d), -0.25, -d / 2, 0.23),
        *moved(books(look, 0.5, 0.22, d), -0.25, -d / 2, 0.53),
    ]


def _ledge(look: FinishPicker, w: float, variant: int) -> Parts:
    finish = look.wood() if variant % 2 == 0 else look.lacquer()
    ledge = [
        block(w, 0.1, 0.02).at(0, 0.06),
        block(w, 0.015, 0.05).at(0, 0.015),
        block(w, 0.015, 0.16).at(0, 0.11),
    ]
    return [
        finished(joined(ledge), finish),
        *moved(books(look, w - 0.2, 0.24, 0.1), -w / 2 + 0.1, 0.03, 0.02),
    ]


def _bracketed(w: float, d: float, z: float, bracket: bool) -> PlainMesh:
    board = block(w, d, 0.025, 0.006).at(z=z)
    if not bracket:
        return board
    arms = [
        tube(
            curve(
                [
                    (s * w * 0.36, d / 2, z - 0.16),
                    (s * w * 0.36, 0.02, z - 0.08),
                    (s * w * 0.36, -d / 2 + 0.03, z),
                ]
            ),
            0.01,
        )
        for s in (-1, 1)
    ]
    return joined([board, *arms])
