"""Structure of an apartment: floors, ceilings, walls with openings, doors and windows."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.floor_plan import (
    CORNER_GAP_M,
    HALF_WALL_M,
    SIDES,
    FloorPlan,
    Opening,
)
from onemap_simulator.generation.furniture.fittings import door, window
from onemap_simulator.generation.mesh import Mesh, box_between
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.room_layout import PlacedModel, place
from onemap_simulator.generation.sampler import Sampler


def room_surfaces(plan: FloorPlan, sampler: Sampler) -> list[PlacedModel]:
    """A floor, a ceiling and four walls for every room, in world coordinates."""
    items = []
    for index, space in enumerate(plan.spaces):
        x0, y0, x1, y1 = space.rect
        floor = box_between((x0, y0, -0.02), (x1, y1, 0.0))
        ceiling = box_between((x0, y0, plan.height_m), (x1, y1, plan.height_m + 0.02))
        paint = _wall_material(sampler, space.kind)
        white = sampler.material("plaster", 1.5, sampler.grey(0.8, 0.98))
        models = [
            assemble("floor", (_floor_material(sampler, space.kind), [floor])),
            assemble("ceiling", (white, [ceiling])),
            *(_wall(plan, index, side, paint) for side in SIDES),
        ]
        items += [place(model, (0.0, 0.0, 0.0), 0.0, index) for model in models]
    return items


def doors_and_windows(plan: FloorPlan, sampler: Sampler) -> list[PlacedModel]:
    """A door in every opening between rooms, a closed entrance, a window in each window hole."""
    items = []
    for opening in plan.doors:
        leaf = None if opening.width > 1.15 else _leaf(plan, opening)
        items.append(_fit(door(sampler, opening.width, leaf), opening, plan, opening.spaces[1]))
    entrance = door(sampler, plan.entrance.width, ("left", 0.0))
    items.append(_fit(entrance, plan.entrance, plan, 0))
    for hole in plan.windows:
        model = window(sampler, hole.width, hole.top - hole.sill)
        items.append(_fit(model, hole, plan, hole.spaces[0]))
    return items


def facing_yaw_deg(opening: Opening, plan: FloorPlan, space: int) -> float:
    """Rotation in degrees that points the front (-y) of a model in the opening into the room."""
    x0, y0, x1, y1 = plan.spaces[space].rect
    if opening.axis == 0:
        return 0.0 if (y0 + y1) / 2 < opening.line else 180.0
    return -90.0 if (x0 + x1) / 2 < opening.line else 90.0


def _fit(model: Model, opening: Opening, plan: FloorPlan, space: int) -> PlacedModel:
    x, y = opening.centre
    return place(model, (x, y, opening.sill), facing_yaw_deg(opening, plan, space), space)


def _leaf(plan: FloorPlan, opening: Opening) -> tuple[str, float] | None:
    """Hinge side and angle of the open leaf: into the corner, else flat on the wall, else none."""
    space = opening.spaces[1]
    x0, y0, x1, y1 = plan.spaces[space].inner
    room = (x0, x1) if opening.axis == 0 else (y0, y1)
    low, high = opening.start - room[0], room[1] - opening.end
    # Seen from the room, with the opening ahead, local -x lies at the lower coordinate
    # unless the model is rotated by 180 or by -90 degrees.
    flipped = facing_yaw_deg(opening, plan, space) in (180.0, -90.0)
    left, right = (high, low) if flipped else (low, high)
    for name, gap in (("left", left), ("right", right)):
        if gap < CORNER_GAP_M + 0.03:
            return (name, 90.0)
    for name, gap in (("left", left), ("right", right)):
        if gap > opening.width + 0.1:
            return (name, 180.0)
    return None


def _wall(plan: FloorPlan, index: int, side: str, paint: Material) -> Model:
    """One wall of a room, from its face to the centre line, around its openings."""
    axis, line, start, end = plan.spaces[index].side(side)
    inward = HALF_WALL_M if side in ("west", "south") else -HALF_WALL_M
    holes = sorted(
        (
            hole
            for hole in (*plan.doors, plan.entrance, *plan.windows)
            if _is_in(hole, index, axis, line)
        ),
        key=lambda hole: hole.start,
    )
    pieces: list[Mesh] = []

    def piece(a: float, b: float, z0: float, z1: float) -> None:
        if b - a > 1e-6 and z1 - z0 > 1e-6:
            near, far = sorted((line, line + inward))
            low, high = (a, near, z0), (b, far, z1)
            if axis == 1:
                low, high = (near, a, z0), (far, b, z1)
            pieces.append(box_between(low, high))

    at = start
    for hole in holes:
        # A centimetre wider than the opening: the frame's faces must not coincide with ours.
        left, right = hole.start - 0.01, hole.end + 0.01
        piece(at, left, 0.0, plan.height_m)
        piece(left, right, 0.0, hole.sill - 0.01)
        piece(left, right, hole.top + 0.01, plan.height_m)
        at = right
    piece(at, end, 0.0, plan.height_m)
    return assemble("wall", (paint, pieces))


def _is_in(hole: Opening, index: int, axis: int, line: float) -> bool:
    return index in hole.spaces and hole.axis == axis and bool(np.isclose(hole.line, line))


def _wall_material(sampler: Sampler, kind: str) -> Material:
    light = sampler.chance(0.7)
    colour = sampler.grey(0.6, 0.97, tint=0.3) if light else sampler.colour()
    if kind in ("bathroom", "kitchen") and sampler.chance(0.6):
        return sampler.material("tiles", sampler.uniform(0.5, 1.0), colour)
    family = sampler.choice(sampler.style.walls)
    shade = sampler.uniform(0.8, 0.95)
    second = (colour[0] * shade, colour[1] * shade, colour[2] * shade)
    return sampler.material(family, sampler.uniform(0.5, 1.5), colour, second)


def _floor_material(sampler: Sampler, kind: str) -> Material:
    families = ("tiles", "checks") if kind == "bathroom" else sampler.style.floors
    family = sampler.choice(families)
    if family in ("planks", "wood"):
        hue = (sampler.uniform(0.45, 0.8), sampler.uniform(0.3, 0.55), sampler.uniform(0.15, 0.35))
        return sampler.material(
            family, sampler.uniform(0.8, 1.4), hue if sampler.chance(0.7) else sampler.colour()
        )
    return sampler.material(family, sampler.uniform(0.8, 1.6), sampler.colour())
