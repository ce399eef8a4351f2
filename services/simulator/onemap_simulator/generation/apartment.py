"""Procedural apartments, deterministic in seed and style."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.floor_plan import FloorPlan, sample_floor_plan
from onemap_simulator.generation.mesh import Material, rotation
from onemap_simulator.generation.placement import Placer, RoomLayout
from onemap_simulator.generation.rooms import add_missing, furnish, hang_curtains
from onemap_simulator.generation.structure import doors_and_windows, room_surfaces
from onemap_simulator.generation.style import TRAINING, Rgb, Sampler, Style
from onemap_simulator.scene.scene import PointLight, Room, Scene, SceneObject


def generate_apartment(seed: int, style: Style = TRAINING) -> Scene:
    """The furnished apartment of a seed: five to seven rooms, light and a start pose.

    Every room can be reached by a disc of radius 0.25 m from the start, and everything in it
    can be approached to within 1 m.
    """
    draw = Sampler(np.random.default_rng(seed), style)
    plan = sample_floor_plan(draw)
    layout = RoomLayout(plan)
    fittings = doors_and_windows(plan, draw)
    layout.add_fixed(fittings)
    for index in range(len(plan.spaces)):
        furnish(Placer(layout, draw, index))
    add_missing(layout, draw)
    hang_curtains(layout, draw)
    items = [*room_surfaces(plan, draw), *fittings, *layout.placed]
    parts = [(index, item, part) for index, item in enumerate(items) for part in item.model.parts]
    textures: dict[Material, int] = {}
    vertices, faces, offset = [], [], 0
    for _, item, (mesh, material) in parts:
        vertices.append(mesh.vertices @ rotation("z", item.yaw_deg).T + item.position_m)
        faces.append(mesh.faces + offset)
        offset += len(mesh.vertices)
        textures.setdefault(material, len(textures))
    counts = [len(part.mesh.faces) for _, _, part in parts]
    materials = [textures[part.material] for _, _, part in parts]
    uv = [part.mesh.uv / part.material.tile_m for _, _, part in parts]
    lights, ambient = _light(draw, plan)
    return Scene(
        name=f"apartment {seed} ({style.name})",
        vertices=np.concatenate(vertices).astype(np.float32),
        faces=np.concatenate(faces).astype(np.int32),
        face_object=np.repeat([index for index, _, _ in parts], counts).astype(np.int32),
        face_texture=np.repeat(materials, counts).astype(np.int32),
        face_uv=np.concatenate(uv).astype(np.float32),
        textures=tuple(material.texture for material in textures),
        objects=tuple(
            SceneObject(item.model.category, plan.spaces[item.space].kind) for item in items
        ),
        lights=lights,
        ambient=ambient,
        rooms=tuple(Room(space.kind, space.inner) for space in plan.spaces),
        start=_start(layout),
    )


def _light(draw: Sampler, plan: FloorPlan) -> tuple[tuple[PointLight, ...], Rgb]:
    """One or two lamps under each ceiling, warm or cold, and the ambient light."""
    lights = []
    for space in plan.spaces:
        x0, y0, x1, y1 = space.inner
        count = 2 if max(x1 - x0, y1 - y0) > 4.5 else 1
        warm = draw.uniform(-0.12, 0.12)
        for share in ((index + 0.5) / count for index in range(count)):
            aside = draw.uniform(0.4, 0.6)
            along_x, along_y = (share, aside) if x1 - x0 > y1 - y0 else (aside, share)
            power = draw.uniform(*draw.style.light)
            at = (x0 + (x1 - x0) * along_x, y0 + (y1 - y0) * along_y, plan.height_m - 0.3)
            lights.append(PointLight(at, (power * (1 + warm), power, power * (1 - warm))))
    level, tone = draw.uniform(*draw.style.ambient), draw.uniform(-0.04, 0.04)
    return tuple(lights), (level * (1 + tone), level, level * (1 - tone))


def _start(layout: RoomLayout) -> tuple[float, float, float]:
    """x, y, yaw: the place of largest clearance in the hub, facing along its longer side."""
    x0, y0, x1, y1 = layout.plan.spaces[0].inner
    centres = layout.grid.centres(np.argwhere(np.ones(layout.grid.shape, bool)))
    in_hub = ((centres >= (x0, y0)) & (centres <= (x1, y1))).all(axis=1)
    x, y = centres[int(np.where(in_hub, layout.clearance().ravel(), 0.0).argmax())].tolist()
    along_x = x1 - x0 > y1 - y0
    ahead = (x0 + x1) / 2 - x if along_x else (y0 + y1) / 2 - y
    return (x, y, (0.0 if along_x else np.pi / 2) + (0.0 if ahead >= 0 else np.pi))
