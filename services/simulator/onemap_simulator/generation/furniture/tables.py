"""Tables, coffee tables and desks."""

from __future__ import annotations

from onemap_simulator.generation.furniture.seating import legs
from onemap_simulator.generation.mesh import Mesh, box, cylinder, lathe, rod, rounded_box
from onemap_simulator.generation.model import Material, Model, assemble, support_surface
from onemap_simulator.generation.sampler import Sampler


def table(sampler: Sampler) -> Model:
    """A dining table: rectangular on legs or trestles, or round on a pedestal."""
    height = sampler.size(0.71, 0.77)
    if sampler.chance(0.35):
        return _round_table(sampler, "table", sampler.size(0.45, 0.6), height)
    return _square_table(
        sampler, "table", (sampler.size(1.1, 1.6), sampler.size(0.75, 0.95), height)
    )


def coffee_table(sampler: Sampler) -> Model:
    """A low table in front of a sofa."""
    height = sampler.size(0.36, 0.48)
    if sampler.chance(0.35):
        return _round_table(sampler, "coffee table", sampler.size(0.32, 0.45), height)
    return _square_table(
        sampler, "coffee table", (sampler.size(0.8, 1.15), sampler.size(0.45, 0.6), height)
    )


def _round_table(sampler: Sampler, category: str, radius: float, height: float) -> Model:
    thickness = sampler.size(0.03, 0.05)
    board = cylinder(radius, thickness, (0, 0, height - thickness), 24)
    if sampler.chance(0.6):
        foot = radius * sampler.size(0.5, 0.7)
        waist = sampler.size(0.03, 0.07)
        profile = [(foot, 0), (foot, 0.03), (waist, 0.09), (waist, height - 0.12), (0.14, height)]
        support = [lathe([(r, z * (height - thickness) / height) for r, z in profile])]
    else:
        support = legs(sampler, radius * 1.35, radius * 1.35, height - thickness, 0.06)
    top = support_surface(radius * 1.35, radius * 1.35, height)
    return assemble(
        category, (sampler.wood(), [board]), (_frame(sampler), support), support_surfaces=(top,)
    )


def _square_table(sampler: Sampler, category: str, size: tuple[float, float, float]) -> Model:
    width, depth, height = size
    thickness = sampler.size(0.025, 0.05)
    meshes: list[Mesh] = []
    board = [box((width, depth, thickness), (0, 0, height - thickness))]
    below = height - thickness
    kind = sampler.integer(0, 3)
    if kind == 0:  # trestles
        for side in (-1, 1):
            x = side * (width / 2 - 0.15)
            foot, head = depth / 2 - 0.05, 0.08
            meshes += [
                rod((x, -foot, 0.0), (x, head, below), 0.025),
                rod((x, foot, 0.0), (x, -head, below), 0.025),
            ]
        meshes.append(
            rod((-width / 2 + 0.15, 0, below / 2), (width / 2 - 0.15, 0, below / 2), 0.02)
        )
    elif kind == 1:  # side panels
        meshes += [
            box((0.05, depth * 0.9, below), (side * (width / 2 - 0.08), 0, 0)) for side in (-1, 1)
        ]
    else:
        meshes += legs(sampler, width, depth, below, sampler.size(0.05, 0.08))
        meshes += [
            box((width - 0.16, 0.02, 0.08), (0, side * (depth / 2 - 0.06), below - 0.08))
            for side in (-1, 1)
        ]
    if category == "coffee table" and sampler.chance(0.5):
        board.append(box((width - 0.14, depth - 0.1, 0.02), (0, 0, height * 0.35)))
    frame = _frame(sampler)
    return assemble(
        category,
        (sampler.wood(), board),
        (frame, meshes),
        support_surfaces=(support_surface(width, depth, height),),
    )


def _frame(sampler: Sampler) -> Material:
    return sampler.wood() if sampler.chance(0.65) else sampler.metal()


def desk(sampler: Sampler) -> Model:
    """A table against a wall with drawers on one or both sides, open in front for the knees."""
    width, depth, height = sampler.size(1.1, 1.5), sampler.size(0.58, 0.7), sampler.size(0.72, 0.77)
    wood, metal = sampler.wood(), sampler.metal()
    fronts = wood if sampler.chance(0.5) else sampler.wood()
    meshes = [box((width, depth, 0.035), (0, 0, height - 0.035))]
    meshes.append(box((width - 0.1, 0.02, 0.35), (0, depth / 2 - 0.05, height - 0.385)))
    sides = [-1, 1] if sampler.chance(0.35) else [sampler.choice([-1, 1])]
    chest_w = min(sampler.size(0.34, 0.42), width / 3)
    drawers, knobs = [], []
    for side in sides:
        x = side * (width / 2 - chest_w / 2 - 0.02)
        meshes.append(box((chest_w, depth - 0.06, height - 0.035), (x, 0, 0)))
        count = sampler.integer(2, 4)
        tall = (height - 0.08) / count
        for index in range(count):
            z = 0.03 + index * tall
            at = (x, -depth / 2 + 0.022, z)
            drawers.append(rounded_box((chest_w - 0.03, 0.025, tall - 0.025), at, 0.006))
            knobs.append(box((0.1, 0.025, 0.018), (x, -depth / 2 + 0.0, z + tall / 2)))
    for side in {-1, 1} - set(sides):
        x = side * (width / 2 - 0.04)
        meshes += [
            box((0.05, 0.05, height - 0.03), (x, y, 0))
            for y in (-depth / 2 + 0.05, depth / 2 - 0.05)
        ]
    return assemble(
        "desk",
        (wood, meshes),
        (fronts, drawers),
        (metal, knobs),
        support_surfaces=(support_surface(width, depth - 0.1, height),),
    )
