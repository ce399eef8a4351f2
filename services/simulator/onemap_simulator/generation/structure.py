"""Structure of an apartment: floors, ceilings, walls with openings, doors and windows.

A door or window is built for an opening of a given width: x runs along the wall, the wall's
centre plane is y = 0, and the room on the -y side is the one it opens into.
"""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import U8
from onemap_simulator.generation.floor_plan import (
    CORNER_GAP_M,
    DOOR_HEIGHT_M,
    HALF_WALL_M,
    SIDES,
    FloorPlan,
    Opening,
)
from onemap_simulator.generation.mesh import (
    Material,
    Mesh,
    Model,
    assemble,
    box,
    box_between,
    cylinder,
    front_panel,
    rod,
)
from onemap_simulator.generation.placement import PlacedModel, place
from onemap_simulator.generation.style import Sampler
from onemap_simulator.generation.textures import smooth_noise, to_image

LEAF_M = 0.04  # thickness of a door's leaf


def room_surfaces(plan: FloorPlan, draw: Sampler) -> list[PlacedModel]:
    """A floor, a ceiling and four walls for every room, in world coordinates."""
    items = []
    for index, space in enumerate(plan.spaces):
        x0, y0, x1, y1 = space.rect
        floor = box_between((x0, y0, -0.02), (x1, y1, 0.0))
        ceiling = box_between((x0, y0, plan.height_m), (x1, y1, plan.height_m + 0.02))
        paint = _wall_material(draw, space.kind)
        white = draw.material("plaster", 1.5, draw.grey(0.8, 0.98))
        models = [
            assemble("floor", (_floor_material(draw, space.kind), [floor])),
            assemble("ceiling", (white, [ceiling])),
            *(_wall(plan, index, side, paint) for side in SIDES),
        ]
        items += [place(model, (0.0, 0.0, 0.0), 0.0, index) for model in models]
    return items


def doors_and_windows(plan: FloorPlan, draw: Sampler) -> list[PlacedModel]:
    """A door in every opening between rooms, a closed entrance, a window in each window hole."""

    def fit(model: Model, opening: Opening, space: int) -> PlacedModel:
        at = (*opening.centre, opening.sill)
        return place(model, at, facing_yaw_deg(opening, plan, space), space)

    items = []
    for opening in plan.doors:
        leaf = None if opening.width > 1.15 else _leaf_of(plan, opening)
        items.append(fit(door(draw, opening.width, leaf), opening, opening.spaces[1]))
    items.append(fit(door(draw, plan.entrance.width, ("left", 0.0)), plan.entrance, 0))
    for hole in plan.windows:
        items.append(fit(window(draw, hole.width, hole.top - hole.sill), hole, hole.spaces[0]))
    return items


def facing_yaw_deg(opening: Opening, plan: FloorPlan, space: int) -> float:
    """Rotation in degrees that points the front (-y) of a model in the opening into the room."""
    x0, y0, x1, y1 = plan.spaces[space].rect
    if opening.axis == 0:
        return 0.0 if (y0 + y1) / 2 < opening.line else 180.0
    return -90.0 if (x0 + x1) / 2 < opening.line else 90.0


def _leaf_of(plan: FloorPlan, opening: Opening) -> tuple[str, float] | None:
    """Hinge side and angle of the open leaf: into the corner, else flat on the wall, else none."""
    space, axis = opening.spaces[1], opening.axis
    inner = plan.spaces[space].inner
    gaps = [opening.start - inner[axis], inner[axis + 2] - opening.end]
    # Seen from the room, with the opening ahead, local -x lies at the lower coordinate
    # unless the model is rotated by 180 or by -90 degrees.
    if facing_yaw_deg(opening, plan, space) in (180.0, -90.0):
        gaps.reverse()
    sides = list(zip(("left", "right"), gaps, strict=True))
    corner = [(name, 90.0) for name, gap in sides if gap < CORNER_GAP_M + 0.03]
    wall = [(name, 180.0) for name, gap in sides if gap > opening.width + 0.1]
    return next(iter(corner + wall), None)


def _wall(plan: FloorPlan, index: int, side: str, paint: Material) -> Model:
    """One wall of a room, from its face to the centre line, around its openings."""
    axis, line, start, end = plan.spaces[index].side(side)
    near, far = sorted((line, line + (HALF_WALL_M if side in ("west", "south") else -HALF_WALL_M)))
    holes = [
        hole
        for hole in (*plan.doors, plan.entrance, *plan.windows)
        if index in hole.spaces and hole.axis == axis and np.isclose(hole.line, line)
    ]
    pieces: list[Mesh] = []

    def piece(a: float, b: float, z0: float, z1: float) -> None:
        if b - a > 1e-6 and z1 - z0 > 1e-6:
            low, high = (a, near, z0), (b, far, z1)
            if axis == 1:
                low, high = (near, a, z0), (far, b, z1)
            pieces.append(box_between(low, high))

    at = start
    for hole in sorted(holes, key=lambda hole: hole.start):
        # A centimetre wider than the opening: the frame's faces must not coincide with ours.
        left, right = hole.start - 0.01, hole.end + 0.01
        piece(at, left, 0.0, plan.height_m)
        piece(left, right, 0.0, hole.sill - 0.01)
        piece(left, right, hole.top + 0.01, plan.height_m)
        at = right
    piece(at, end, 0.0, plan.height_m)
    return assemble("wall", (paint, pieces))


def _wall_material(draw: Sampler, kind: str) -> Material:
    light = draw.chance(0.7)
    colour = draw.grey(0.6, 0.97, tint=0.3) if light else draw.colour()
    if kind in ("bathroom", "kitchen") and draw.chance(0.6):
        return draw.material("tiles", draw.uniform(0.5, 1.0), colour)
    family, shade = draw.choice(draw.style.walls), draw.uniform(0.8, 0.95)
    second = (colour[0] * shade, colour[1] * shade, colour[2] * shade)
    return draw.material(family, draw.uniform(0.5, 1.5), colour, second)


def _floor_material(draw: Sampler, kind: str) -> Material:
    family = draw.choice(("tiles", "checks") if kind == "bathroom" else draw.style.floors)
    if family not in ("planks", "wood"):
        return draw.material(family, draw.uniform(0.8, 1.6), draw.colour())
    brown = (draw.uniform(0.45, 0.8), draw.uniform(0.3, 0.55), draw.uniform(0.15, 0.35))
    tile_m = draw.uniform(0.8, 1.4)
    return draw.material(family, tile_m, brown if draw.chance(0.7) else draw.colour())


def door(draw: Sampler, width: float, leaf: tuple[str, float] | None) -> Model:
    """A door around a clear opening of ``width``, centred on x = 0.

    ``leaf`` is None for a passage, else where the leaf hangs and the angle it stands open at,
    in degrees: ("left", 90.0) has its hinge at -width / 2 and stands into the room at -y.
    """
    wood, metal = draw.wood(), draw.metal()
    frame = _door_frame(draw, width)
    if leaf is None:
        return assemble("door", (wood, frame))
    hinge, degrees = leaf
    groups = [_leaf(draw, width), _handles(draw, width)]
    sign = 1.0
    if hinge == "right":
        groups, sign = [[_mirrored(mesh) for mesh in group] for group in groups], -1.0
    y = -HALF_WALL_M + LEAF_M if degrees == 0.0 else -HALF_WALL_M - LEAF_M / 2 - 0.01
    pivot = (-sign * width / 2, y, 0.0)
    panels, handle = (
        [mesh.rotated("z", -sign * degrees).translated(*pivot) for mesh in group]
        for group in groups
    )
    paint = draw.wood() if draw.chance(0.5) else wood
    return assemble("door", (wood, frame), (paint, panels), (metal, handle))


def _door_frame(draw: Sampler, width: float) -> list[Mesh]:
    """Jambs and lintel casing that cover the wall's thickness, outside of the clear opening."""
    casing, depth = draw.size(0.06, 0.1), 2 * (HALF_WALL_M + 0.015)
    jamb, x = (casing, depth, DOOR_HEIGHT_M + casing), width / 2 + casing / 2
    return [
        *(box(jamb, (s * x, 0.0, 0.0)) for s in (-1, 1)),
        box((width, depth, casing), (0.0, 0.0, DOOR_HEIGHT_M)),
    ]


def _leaf(draw: Sampler, width: float) -> list[Mesh]:
    """The leaf from its hinge at x = 0 to x = width, with raised panels on both faces."""
    half, raised = LEAF_M / 2, LEAF_M / 2 + 0.012
    meshes = [box_between((0.01, -half, 0.01), (width, half, DOOR_HEIGHT_M - 0.01))]
    columns, rows = draw.integer(1, 2), draw.integer(1, 4)
    wide, high = (width - 0.1) / columns, (DOOR_HEIGHT_M - 0.1) / rows
    for column in range(columns if draw.chance(0.85) else 0):
        for row in range(rows):
            x, z = 0.05 + column * wide, 0.05 + row * high
            upper = (x + wide - 0.05, raised, z + high - 0.05)
            meshes.append(box_between((x + 0.05, -raised, z + 0.05), upper))
    return meshes


def _handles(draw: Sampler, width: float) -> list[Mesh]:
    x, reach, z = width - 0.08, LEAF_M / 2 + 0.045, 1.02
    if draw.chance(0.5):
        levers = [rod((x, y, z), (x - 0.13, y, z), 0.012) for y in (-reach, reach)]
        return [*levers, rod((x, -reach, z), (x, reach, z), 0.014)]
    return [cylinder(0.03, 2 * reach, segments=10).rotated("x", -90).translated(x, -reach, z)]


def _mirrored(mesh: Mesh) -> Mesh:
    """The mesh reflected in x = 0, faces still wound outwards."""
    return Mesh(mesh.vertices * (-1.0, 1.0, 1.0), mesh.faces[:, ::-1], mesh.uv[:, ::-1])


def window(draw: Sampler, width: float, height: float) -> Model:
    """A window that fills an opening; z = 0 is its sill. The panes show a bright outdoors."""
    frame, bar = draw.pale() if draw.chance(0.6) else draw.wood(), draw.size(0.05, 0.08)
    depth, x = 2 * HALF_WALL_M, width / 2 - bar / 2
    meshes = [
        *(box((bar, depth, height), (s * x, 0.0, 0.0)) for s in (-1, 1)),
        *(box((width, depth, bar), (0.0, 0.0, z)) for z in (height - bar, 0.0)),
        box((width + 0.12, 0.16, 0.04), (0.0, -HALF_WALL_M, -0.04)),
    ]
    for column in range(1, draw.integer(1, 3)):
        share = column / 2 if width < 1.3 else column / 3
        meshes.append(box((0.04, 0.06, height), (width * (share - 0.5), 0.0, 0.0)))
    if draw.chance(0.5):
        meshes.append(box((width, 0.06, 0.04), (0.0, 0.0, height * draw.uniform(0.5, 0.7))))
    view = Material(_outdoors(draw.rng))
    panes = [front_panel(width, height, (0.0, 0.02, 0.0))]
    return assemble("window", (frame, meshes), (view, panes))


def _outdoors(rng: np.random.Generator) -> U8:
    """A blurred view (64, 64, 3): sky with clouds, a horizon, something green or built."""
    rows = np.linspace(0, 1, 64, dtype=np.float32)[:, None, None]
    sky = np.array([0.62, 0.78, 0.95]) * (1 - rows) + np.array([0.92, 0.95, 0.98]) * rows
    clouds = smooth_noise(rng, (4, 4))[..., None] * 0.25
    ground = np.array(rng.uniform([0.25, 0.4, 0.2], [0.6, 0.65, 0.45]))
    horizon = rng.uniform(0.5, 0.85) + 0.15 * smooth_noise(rng, (1, 8))[:1, :, None]
    mix = np.clip((rows - horizon) * 12, 0, 1)
    return to_image((sky + clouds) * (1 - mix) + (ground + clouds) * mix)
