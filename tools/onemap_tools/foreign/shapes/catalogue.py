"""All classes of the set, with the range of sizes that a real one has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F64
from onemap_tools.foreign.finish import FinishedPart
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.shapes import (
    bathroom,
    bedroom,
    chairs,
    containers,
    desks,
    devices,
    fridges,
    kitchen,
    nightstands,
    plants,
    radiators,
    shelves,
    sinks,
    sofas,
    stools,
    storage,
    strangers,
    tables,
    textiles,
    wall_art,
)

SHAPES = 8  # of every class

Builder = Callable[[int, FinishPicker], list[FinishedPart]]
Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class ForeignClass:
    """A class: how its shapes are made, and their width (x), depth (y) and height in metres."""

    build: Builder
    width_m: Range
    depth_m: Range
    height_m: Range


@dataclass(frozen=True, slots=True, eq=False)
class ForeignPiece:
    """One piece: its back at y = 0, its middle at x = 0, its lowest point at z = 0."""

    category: str
    parts: tuple[FinishedPart, ...]

    @property
    def bounds(self) -> tuple[F64, F64]:
        """Lower and upper corner (3,) in metres."""
        points = np.concatenate([part.mesh.vertices for part in self.parts])
        return points.min(axis=0), points.max(axis=0)


CATALOGUE: dict[str, ForeignClass] = {
    "sofa": ForeignClass(sofas.sofa, (1.4, 2.7), (0.7, 1.7), (0.6, 1.15)),
    "armchair": ForeignClass(sofas.armchair, (0.6, 1.1), (0.6, 1.1), (0.65, 1.3)),
    "chair": ForeignClass(chairs.chair, (0.35, 0.75), (0.4, 0.75), (0.75, 1.25)),
    "stool": ForeignClass(stools.stool, (0.3, 0.55), (0.2, 0.55), (0.35, 0.8)),
    "bench": ForeignClass(stools.bench, (0.9, 1.6), (0.3, 0.6), (0.4, 0.95)),
    "table": ForeignClass(tables.table, (1.1, 1.95), (0.75, 1.3), (0.7, 0.8)),
    "coffee table": ForeignClass(tables.coffee_table, (0.7, 1.3), (0.45, 0.9), (0.32, 0.5)),
    "desk": ForeignClass(desks.desk, (1.1, 1.6), (0.5, 0.8), (0.7, 1.55)),
    "nightstand": ForeignClass(nightstands.nightstand, (0.35, 0.55), (0.34, 0.55), (0.42, 0.66)),
    "bookcase": ForeignClass(shelves.bookcase, (0.65, 1.6), (0.24, 0.5), (1.0, 2.2)),
    "wardrobe": ForeignClass(storage.wardrobe, (0.9, 2.2), (0.5, 1.5), (1.8, 2.4)),
    "dresser": ForeignClass(storage.dresser, (0.45, 1.7), (0.4, 0.6), (0.7, 1.6)),
    "shelf": ForeignClass(shelves.shelf, (0.6, 1.3), (0.1, 0.35), (0.1, 1.2)),
    "bed": ForeignClass(bedroom.bed, (0.95, 2.5), (1.95, 2.4), (0.5, 1.4)),
    "pillow": ForeignClass(bedroom.pillow, (0.35, 0.8), (0.15, 0.55), (0.1, 0.2)),
    "refrigerator": ForeignClass(fridges.refrigerator, (0.5, 0.95), (0.55, 0.85), (0.8, 2.1)),
    "oven": ForeignClass(kitchen.oven, (0.45, 1.15), (0.6, 0.85), (0.85, 1.15)),
    "kitchen cabinet": ForeignClass(kitchen.kitchen_cabinet, (1.1, 1.9), (0.55, 0.75), (0.85, 2.3)),
    "sink": ForeignClass(sinks.sink, (0.4, 1.2), (0.4, 0.75), (0.25, 1.3)),
    "microwave": ForeignClass(devices.microwave, (0.44, 0.56), (0.34, 0.48), (0.25, 0.35)),
    "toilet": ForeignClass(bathroom.toilet, (0.35, 0.55), (0.5, 0.85), (0.42, 2.0)),
    "bathtub": ForeignClass(bathroom.bathtub, (1.4, 1.85), (0.7, 0.9), (0.5, 2.05)),
    "washing machine": ForeignClass(
        bathroom.washing_machine, (0.55, 0.65), (0.42, 0.75), (0.8, 1.1)
    ),
    "radiator": ForeignClass(radiators.radiator, (0.45, 1.35), (0.035, 0.3), (0.5, 1.5)),
    "television": ForeignClass(devices.television, (0.6, 1.6), (0.03, 0.7), (0.45, 1.4)),
    "laptop": ForeignClass(devices.laptop, (0.28, 0.42), (0.18, 0.5), (0.15, 0.32)),
    "lamp": ForeignClass(devices.lamp, (0.15, 1.4), (0.15, 0.65), (0.3, 1.9)),
    "potted plant": ForeignClass(plants.potted_plant, (0.15, 2.2), (0.15, 2.2), (0.25, 1.8)),
    "vase": ForeignClass(plants.vase, (0.08, 0.65), (0.08, 0.65), (0.2, 0.95)),
    "curtain": ForeignClass(textiles.curtain, (1.6, 2.6), (0.05, 0.3), (1.2, 2.5)),
    "rug": ForeignClass(textiles.rug, (1.4, 2.3), (1.0, 1.8), (0.005, 0.05)),
    "mirror": ForeignClass(wall_art.mirror, (0.4, 1.1), (0.01, 0.3), (0.6, 1.9)),
    "picture": ForeignClass(wall_art.picture, (0.35, 1.5), (0.01, 0.08), (0.35, 1.15)),
    "basket": ForeignClass(containers.basket, (0.3, 0.65), (0.3, 0.6), (0.2, 0.7)),
    "trash can": ForeignClass(containers.trash_can, (0.2, 0.45), (0.2, 0.5), (0.28, 0.7)),
    "piano": ForeignClass(strangers.piano, (1.35, 1.6), (0.5, 0.75), (1.0, 1.4)),
    "ladder": ForeignClass(strangers.ladder, (0.35, 0.6), (0.3, 1.6), (0.85, 2.3)),
    "ironing board": ForeignClass(strangers.ironing_board, (1.1, 1.4), (0.3, 0.5), (0.8, 1.15)),
}


def build_piece(category: str, variant: int, look: FinishPicker) -> ForeignPiece:
    """Shape ``variant``, 0 to SHAPES - 1, of a class, set on its axes; KeyError: no such class."""
    if not 0 <= variant < SHAPES:
        raise ValueError(f"shape {variant} of {category}: every class has shapes 0 to {SHAPES - 1}")
    piece = ForeignPiece(category, tuple(CATALOGUE[category].build(variant, look)))
    lower, upper = piece.bounds
    x, y, z = -(lower[0] + upper[0]) / 2, -upper[1], -lower[2]
    set_down = [FinishedPart(part.mesh.at(x, y, z), part.uv, part.finish) for part in piece.parts]
    return ForeignPiece(category, tuple(set_down))
