"""Procedural apartments, deterministic in seed and style."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F64, U8
from onemap_simulator.generation.floor_plan import FloorPlan, sample_floor_plan
from onemap_simulator.generation.mesh import Material, rotation
from onemap_simulator.generation.placement import PlacedModel, Placer, RoomLayout
from onemap_simulator.generation.rooms import add_missing, furnish, hang_curtains
from onemap_simulator.generation.structure import doors_and_windows, room_surfaces
from onemap_simulator.generation.style import TRAINING, Sampler, Style
from onemap_simulator.scene.scene import PointLight, Room, Scene, SceneObject


@dataclass(frozen=True, slots=True)
class FurnishedApartment:
    """An apartment as placed models, before they are merged; fields as in ``Scene``."""

    name: str
    items: tuple[PlacedModel, ...]
    rooms: tuple[Room, ...]
    lights: tuple[PointLight, ...]
    ambient: tuple[float, float, float]
    start: tuple[float, float, float]


def generate_apartment(seed: int, style: Style = TRAINING) -> Scene:
    """The furnished apartment of a seed: five to seven rooms, light and a start pose.

    Every room can be reached by a disc of radius 0.25 m from the start, and everything in it
    can be approached to within 1 m.
    """
    return compile_scene(furnish_apartment(seed, style))


def furnish_apartment(seed: int, style: Style = TRAINING) -> FurnishedApartment:
    """The same apartment as models, for what changes them before they become a scene."""
    draw = Sampler(np.random.default_rng(seed), style)
    plan = sample_floor_plan(draw)
    layout = RoomLayout(plan)
    fittings = doors_and_windows(plan, draw)
    layout.add_fixed(fittings)
    for index in range(len(plan.spaces)):
        furnish(Placer(layout, draw, index))
    add_missing(layout, draw)
    hang_curtains(layout, draw)
    items = (*room_surfaces(plan, draw), *fittings, *layout.placed)
    lights, ambient = _light(draw, plan)
    rooms = tuple(Room(space.kind, space.inner) for space in plan.spaces)
    name = f"apartment {seed} ({style.name})"
    return FurnishedApartment(name, items, rooms, lights, ambient, _start(layout))


def _light(
    draw: Sampler, plan: FloorPlan
) -> tuple[tuple[PointLight, ...], tuple[float, float, float]]:
    """One or two lamps under each ceiling, warm or cold, and the ambient light."""
    lights = []
    for space in plan.spaces:
        x0, y0, x1, y1 = space.inner
        count = 2 if max(x1 - x0, y1 - y0) > 4.5 else 1
        warm = draw.uniform(-0.12, 0.12)
        for index in range(count):
            share = (index + 0.5) / count
            x = x0 + (x1 - x0) * (share if x1 - x0 > y1 - y0 else draw.uniform(0.4, 0.6))
            y = y0 + (y1 - y0) * (share if x1 - x0 <= y1 - y0 else draw.uniform(0.4, 0.6))
            power = draw.uniform(*draw.style.light)
            colour = (power * (1 + warm), power, power * (1 - warm))
            lights.append(PointLight((x, y, plan.height_m - 0.3), colour))
    level, tone = draw.uniform(*draw.style.ambient), draw.uniform(-0.04, 0.04)
    return tuple(lights), (level * (1 + tone), level, level * (1 - tone))


def _start(layout: RoomLayout) -> tuple[float, float, float]:
    """x, y, yaw: the place of largest clearance in the hub, facing along its longer side."""
    x0, y0, x1, y1 = layout.plan.spaces[0].inner
    clearance = layout.clearance()
    cells = np.stack(np.meshgrid(*map(np.arange, layout.grid.shape), indexing="ij"), axis=-1)
    centres = layout.grid.centres(cells)
    x, y = centres[..., 0], centres[..., 1]
    clearance[(x < x0) | (x > x1) | (y < y0) | (y > y1)] = 0.0
    best = np.unravel_index(int(clearance.argmax()), clearance.shape)
    along_x = x1 - x0 > y1 - y0
    here = centres[best]
    ahead = (x0 + x1) / 2 - here[0] if along_x else (y0 + y1) / 2 - here[1]
    yaw = (0.0 if along_x else np.pi / 2) + (0.0 if ahead >= 0 else np.pi)
    return (float(here[0]), float(here[1]), float(yaw))


def compile_scene(apartment: FurnishedApartment) -> Scene:
    """Merge placed models into one scene: transformed, concatenated, textures shared."""
    textures: dict[Material, int] = {}
    vertices: list[F64] = []
    faces, owners, materials, uv = [], [], [], []
    offset = 0
    for index, item in enumerate(apartment.items):
        R = rotation("z", item.yaw_deg)
        for mesh, material in item.model.parts:
            vertices.append(mesh.vertices @ R.T + item.position_m)
            faces.append(mesh.faces + offset)
            owners.append(np.full(len(mesh.faces), index))
            texture = textures.setdefault(material, len(textures))
            materials.append(np.full(len(mesh.faces), texture))
            uv.append(mesh.uv / material.tile_m)
            offset += len(mesh.vertices)
    images: tuple[U8, ...] = tuple(material.texture for material in textures)
    return Scene(
        name=apartment.name,
        vertices=np.concatenate(vertices).astype(np.float32),
        faces=np.concatenate(faces).astype(np.int32),
        face_object=np.concatenate(owners).astype(np.int32),
        face_texture=np.concatenate(materials).astype(np.int32),
        face_uv=np.concatenate(uv).astype(np.float32),
        textures=images,
        objects=tuple(
            SceneObject(item.model.category, apartment.rooms[item.space].kind)
            for item in apartment.items
        ),
        lights=apartment.lights,
        ambient=apartment.ambient,
        rooms=apartment.rooms,
        start=apartment.start,
    )
