"""A small floor plan and plain models for the tests of the generator."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.floor_plan import FloorPlan, Opening, Space
from onemap_simulator.generation.mesh import box
from onemap_simulator.generation.model import Material, Model, assemble, support_surface
from onemap_simulator.generation.placement import Placer
from onemap_simulator.generation.room_layout import RoomLayout
from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.generation.style import TRAINING

GREY = Material(np.full((2, 2, 3), 128, np.uint8))
PLAN = FloorPlan(
    spaces=(Space("hallway", (0, 0, 4, 2)), Space("bedroom", (0, 2, 4, 6))),
    doors=(Opening(0, 2.0, 1.5, 2.5, 0.0, 2.05, (0, 1)),),
    entrance=Opening(1, 0.0, 0.5, 1.5, 0.0, 2.05, (0,)),
    windows=(Opening(0, 6.0, 1.0, 2.5, 0.9, 2.1, (1,)),),
    height_m=2.5,
)


def block(width: float, depth: float, height: float) -> Model:
    return assemble(
        "box",
        (GREY, [box((width, depth, height))]),
        support_surfaces=(support_surface(width, depth, height),),
    )


def make_placer(layout: RoomLayout, space: int = 1) -> Placer:
    return Placer(layout, Sampler(np.random.default_rng(0), TRAINING), space)


def room_of(kind: str) -> FloorPlan:
    """A hub and one large room of the kind."""
    return FloorPlan(
        spaces=(Space("hallway", (0, 0, 6, 2)), Space(kind, (0, 2, 6, 8))),
        doors=(Opening(0, 2.0, 2.5, 3.5, 0.0, 2.05, (0, 1)),),
        entrance=Opening(1, 0.0, 0.5, 1.5, 0.0, 2.05, (0,)),
        windows=(),
        height_m=2.6,
    )
