"""Refrigerators in steel and in colour."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.finish import finished, pictured
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.images import abstract
from onemap_tools.foreign.plain_mesh import (
    PlainMesh,
    block,
    cushion,
    joined,
)
from onemap_tools.foreign.screens import menu
from onemap_tools.foreign.shapes.parts import Parts, handle, moved

COLOURS = ((0.72, 0.12, 0.12), (0.55, 0.75, 0.72), (0.93, 0.88, 0.74), (0.16, 0.24, 0.36))


def refrigerator(variant: int, look: FinishPicker) -> Parts:
    """A refrigerator of 0.55 to 0.91 m width and 0.85 to 1.9 m height."""
    sizes = (
        (0.6, 0.65, 1.85), (0.91, 0.7, 1.78), (0.6, 0.66, 1.55), (0.55, 0.58, 1.44),
        (0.6, 0.65, 2.0), (0.83, 0.72, 1.8), (0.55, 0.6, 0.86), (0.7, 0.68, 1.9),
    )  # fmt: skip
    w, d, h = sizes[variant]
    if variant in (0, 1, 5):
        skin = look.steel()
    elif variant in (2, 7):
        skin = look.lacquer(COLOURS[int(look.rng.integers(len(COLOURS)))])
    elif variant == 4:
        skin = look.steel((0.18, 0.18, 0.19))
    else:
        skin = look.lacquer((0.93, 0.93, 0.92))
    grey = look.plastic((0.3, 0.3, 0.31))
    bevel = 0.09 if variant in (2, 7) else 0.012
    parts: Parts = [
        finished(
            cushion(w - 0.004, d - 0.06, h - 0.04, 0.01).at(0, 0.03, 0.03),
            skin if variant in (2, 7) else grey,
        )
    ]
    doors = _fridge_doors(variant, w, h)
    for x, z, wide, tall in doors:
        parts.append(
            finished(
                cushion(
                    wide - 0.008, 0.07, tall - 0.008, bevel / 2 if bevel > 0.05 else 0.012, steps=4
                ).at(x, -d / 2 + 0.035, z),
                skin,
            )
        )
    parts += _fridge_handles(variant, doors, d, look)
    if variant in (1, 5):
        parts.append(
            finished(
                block(0.2, 0.012, 0.34, 0.004).at(doors[0][0], -d / 2 - 0.004, 1.0),
                look.dark_glass(),
            )
        )
    if variant == 5:
        screen = look.shown(menu(look.rng), 0.7)
        parts += moved([pictured(0.3, 0.36, screen)], doors[1][0], -d / 2 - 0.006, 1.1)
    if variant in (3, 6, 0):
        parts += _magnets(look, w, d, h)
    return parts


def _fridge_doors(variant: int, w: float, h: float) -> list[tuple[float, float, float, float]]:
    """Middle x, lower z, width and height of every door."""
    if variant in (1, 5):
        low = 0.05 if variant == 1 else 0.62
        pair = [(s * w / 4, low, w / 2, h - low) for s in (-1, 1)]
        return pair if variant == 1 else [*pair, (0, 0.34, w, 0.28), (0, 0.05, w, 0.29)]
    if variant in (2, 6):
        return [(0, 0.05, w, h - 0.05)]
    split = h * (0.38 if variant in (0, 4) else 0.7)
    return [(0, 0.05, w, split - 0.05), (0, split, w, h - split)]


def _fridge_handles(
    variant: int, doors: list[tuple[float, float, float, float]], d: float, look: FinishPicker
) -> Parts:
    made: list[PlainMesh] = []
    for i, (x, z, wide, tall) in enumerate(doors):
        long = min(0.75 * tall, 0.7)
        if variant in (1, 5) and i < 2:
            at = x - np.sign(x) * (wide / 2 - 0.05)
            made.append(handle(2, long).turned(roll=np.pi / 2).at(at, -d / 2, z + tall / 2))
        elif variant == 5:
            made.append(handle(2, 0.7 * wide).at(x, -d / 2, z + tall - 0.06))
        elif variant in (2, 7):
            made.append(
                handle(0, 0.2)
                .scaled(1, 1.6, 1.6)
                .turned(roll=np.pi / 2)
                .at(wide / 2 - 0.08, -d / 2, z + tall * (0.55 if variant == 2 else 0.3))
            )
        elif variant != 4:
            high = z + tall - long / 2 - 0.06 if i == 0 else z + long / 2 + 0.06
            made.append(handle(2, long).turned(roll=np.pi / 2).at(wide / 2 - 0.06, -d / 2, high))
    return [finished(joined(made), look.chrome())] if made else []


def _magnets(look: FinishPicker, w: float, d: float, h: float) -> Parts:
    """Notes, a child's drawing and photographs on the door."""
    parts: Parts = []
    for _ in range(5):
        size = look.between(0.06, 0.16)
        card = pictured(size, size * look.between(0.8, 1.4), look.shown(abstract(look.rng)))
        parts += moved(
            [card], look.between(-0.3, 0.2) * w, -d / 2 - 0.004, look.between(0.55, 0.85) * h
        )
    return parts
