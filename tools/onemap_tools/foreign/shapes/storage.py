"""Wardrobes and dressers."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.finish import finished, pictured
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import block, curve, joined, loft, ring, tube
from onemap_tools.foreign.shapes.parts import (
    Parts,
    corners,
    frame,
    front,
    handle,
    legs,
    moved,
    plinth,
    rotated,
)

BOARD_M = 0.022


def wardrobe(variant: int, look: FinishPicker) -> Parts:
    """A tall cupboard for clothes, 1.9 to 2.3 m high."""
    w, d, h = look.between(1.0, 1.5), look.between(0.56, 0.62), look.between(1.95, 2.25)
    makers = (
        lambda: _hinged(look, (w, d, h), 2, 2),
        lambda: _sliding(look, w + 0.4, d, h, mirrors=1),
        lambda: _hinged(look, (0.95, d, h), 2, 0),
        lambda: _hinged(look, (w + 0.1, d, h), 3, 1, mirror=True),
        lambda: _armoire(look, w, d, h),
        lambda: _sliding(look, w + 0.5, d, h + 0.1, mirrors=0),
        lambda: _hinged(look, (w, d, h), 2, 4),
        lambda: _open_wardrobe(look, w, d, h),
    )
    return makers[variant]()


def _hinged(
    look: FinishPicker,
    size: tuple[float, float, float],
    doors: int,
    kind: int,
    *,
    mirror: bool = False,
) -> Parts:
    """Doors on hinges; a middle one with a mirror if asked. size: width, depth, height."""
    w, d, h = size
    finish = look.lacquer() if kind in (0, 1) else look.wood()
    step = w / doors
    parts: Parts = [
        finished(block(w, d, h - 0.08, 0.006).at(z=0.08), finish, upright=True),
        plinth(w, d, finish),
    ]
    fronts, pulls = [], []
    for i in range(doors):
        x = (i + 0.5) * step - w / 2
        fronts.append(front(step - 0.008, h - 0.12, kind).at(x, -d / 2, 0.1))
        side = 1 if i < doors / 2 else -1
        pulls.append(
            handle(0 if kind else 2, 0.16)
            .turned(roll=np.pi / 2)
            .at(x + side * (step / 2 - 0.05), -d / 2 - 0.02, 1.0)
        )
    parts += [
        finished(joined(fronts), finish, upright=True),
        finished(joined(pulls), look.brass() if kind else look.steel()),
    ]
    if mirror:
        glass = pictured(step - 0.14, h - 0.4, look.silver())
        parts += moved([glass], 0, -d / 2 - 0.024, 0.24)
    return parts


def _sliding(look: FinishPicker, w: float, d: float, h: float, mirrors: int) -> Parts:
    """Two or three wide doors that overlap, one of mirror glass, in a metal frame."""
    finish, doors = look.lacquer(), 2 if w < 1.75 else 3
    step = w / doors
    parts: Parts = [finished(block(w, d, h, 0.004), finish)]
    for i in range(doors):
        x, y = (i + 0.5) * step - w / 2, -d / 2 - 0.012 - 0.02 * (i % 2)
        if i < mirrors:
            parts += moved([pictured(step - 0.04, h - 0.12, look.silver())], x, y - 0.006, 0.06)
        else:
            panel = look.wood() if i % 2 else look.lacquer()
            parts.append(
                finished(block(step, 0.018, h - 0.08, 0.002).at(x, y, 0.04), panel, upright=True)
            )
        parts.append(
            finished(frame(step + 0.02, h - 0.06, 0.03, 0.012).at(x, y - 0.004, 0.03), look.steel())
        )
    return parts


def _armoire(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    """An old cupboard: moulded cornice, arched panels, ball feet."""
    wood = look.wood(gloss=0.2)
    cornice = loft(
        [
            ring(w + s, d + s, z, 30, 48)
            for s, z in (
                (0.0, h - 0.2),
                (0.03, h - 0.16),
                (0.04, h - 0.1),
                (0.14, h - 0.06),
                (0.16, h),
                (0.1, h),
            )
        ]
    )
    feet = joined(
        [
            loft([ring(0.1 * r, 0.1 * r, z) for r, z in ((0.6, 0), (1, 0.05), (0.7, 0.1))]).at(x, y)
            for x, y in corners(w, d, 0.06)
        ]
    )
    fronts, step = [], w / 2
    for s in (-1, 1):
        x = s * step / 2
        arch = curve(
            [
                (-0.3 * step, 0, 0),
                (-0.3 * step, 0, 1.0),
                (0, 0, 1.2),
                (0.3 * step, 0, 1.0),
                (0.3 * step, 0, 0),
            ]
        )
        fronts += [
            front(step - 0.02, h - 0.42, 0).at(x, -d / 2, 0.24),
            tube(arch, 0.016).at(x, -d / 2 - 0.02, 0.42),
            front(0.5 * step, 0.7, 2).at(x, -d / 2 - 0.01, 0.45),
        ]
    fronts.append(front(w - 0.04, 0.13, 2).at(0, -d / 2, 0.1))
    keys = joined([handle(1).at(s * 0.06, -d / 2 - 0.02, 1.0) for s in (-1, 1)])
    return [
        finished(
            joined([block(w, d, h - 0.26, 0.01).at(z=0.1), cornice, feet]), wood, upright=True
        ),
        finished(joined(fronts), wood, upright=True),
        finished(keys, look.brass()),
    ]


def _open_wardrobe(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    """One door stands open and shows clothes on a rail."""
    finish = look.wood()
    sides = [block(BOARD_M, d, h).at(s * (w / 2 - 0.011)) for s in (-1, 0, 1)]
    boards = [block(w, d, BOARD_M).at(z=z) for z in (0.06, h - BOARD_M, 0.85 * h)] + [
        block(w, 0.01, h).at(0, d / 2 - 0.005)
    ]
    shut = front(w / 2 - 0.01, h - 0.1, 0).at(w / 4, -d / 2, 0.06)
    open_ = rotated(
        moved([finished(front(w / 2 - 0.01, h - 0.1, 0), finish, upright=True)], w / 4), yaw=-1.75
    )
    parts: Parts = [
        finished(joined([*sides, *boards, shut]), finish, upright=True),
        *moved(open_, -w / 2, -d / 2, 0.06),
    ]
    x = -w / 2 + 0.08
    while x < -0.1:
        tall, thick = look.between(0.7, 1.1), look.between(0.04, 0.08)
        coat = loft(
            [
                ring(thick * s, 0.42 * s, z, 3)
                for s, z in ((1.0, 0), (0.9, 0.5 * tall), (0.95, 0.85 * tall), (0.3, tall))
            ]
        )
        parts.append(finished(coat.at(x, 0.02, 0.8 * h - tall), look.cloth()))
        x += thick + 0.02
    return [
        *parts,
        finished(tube([(-w / 2, 0.02, 0.81 * h), (0, 0.02, 0.81 * h)], 0.012), look.chrome()),
    ]


def dresser(variant: int, look: FinishPicker) -> Parts:
    """A chest of drawers, 0.75 to 1.2 m high."""
    rows = (3, 4, 5, 3, 4, 3, 6, 4)[variant]
    columns = (1, 1, 1, 2, 2, 3, 1, 1)[variant]
    kind = (0, 1, 0, 0, 2, 0, 3, 0)[variant]
    w = (0.9, 0.85, 0.6, 1.4, 1.2, 1.5, 0.5, 1.0)[variant] * look.between(0.95, 1.08)
    h, d = (
        (0.8, 0.95, 1.15, 0.75, 0.9, 0.78, 1.25, 0.85)[variant] * look.between(0.96, 1.05),
        look.between(0.42, 0.5),
    )
    feet = (0.12, 0.08, 0.0, 0.18, 0.1, 0.15, 0.05, 0.06)[variant]
    body = look.wood() if variant in (0, 4, 5, 7) else look.lacquer()
    face = look.wood() if variant in (3, 7) else body
    parts: Parts = [
        finished(
            joined(
                [
                    block(w, d, h - feet - 0.02, 0.004).at(z=feet),
                    block(w + 0.02, d + 0.02, 0.025, 0.008).at(z=h - 0.025),
                ]
            ),
            body,
        )
    ]
    if feet:
        parts.append(
            finished(legs(w, d, feet + 0.01, (1, 0, 0, 3, 4, 1, 0, 2)[variant], 0.06), look.wood())
        )
    step_x, step_z = (w - 0.03) / columns, (h - feet - 0.06) / rows
    fronts, pulls = [], []
    for row in range(rows):
        for column in range(columns):
            x, z = (column + 0.5) * step_x - (w - 0.03) / 2, feet + 0.02 + row * step_z
            fronts.append(front(step_x - 0.012, step_z - 0.012, kind).at(x, -d / 2, z))
            places = (-0.28 * step_x, 0.28 * step_x) if columns == 1 and w > 0.8 else (0.0,)
            pulls += [
                handle((2, 1, 0, 2, 3, 0, 1, 3)[variant]).at(x + at, -d / 2 - 0.02, z + step_z / 2)
                for at in places
            ]
    parts += [
        finished(joined(fronts), face),
        finished(joined(pulls), look.brass() if kind else look.iron()),
    ]
    if variant == 7:
        mirror = moved([pictured(0.6, 0.5, look.silver())], 0, 0.13, h + 0.08)
        parts += [*mirror, finished(frame(0.66, 0.58, 0.04, 0.03).at(0, 0.14, h + 0.04), body)]
    return parts
