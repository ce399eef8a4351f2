"""Procedural apartments: the same seed and style give the same scene."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64, U8
from onemap_simulator.generation.clutter import complete, hang_curtains
from onemap_simulator.generation.floor_plan import Plan, draw_plan
from onemap_simulator.generation.mesh import rotation
from onemap_simulator.generation.model import Material
from onemap_simulator.generation.placement import Arranger
from onemap_simulator.generation.room_layout import Placed, Site
from onemap_simulator.generation.rooms import furnish
from onemap_simulator.generation.sampler import Pick
from onemap_simulator.generation.structure import bare_rooms, doors_and_windows
from onemap_simulator.generation.style import TRAINING, Style
from onemap_simulator.scene.scene import Light, Room, Scene, SceneObject


def generate_apartment(seed: int, style: Style = TRAINING) -> Scene:
    """The furnished apartment of a seed: five to seven rooms, light and a start pose.

    Every room can be reached by a disc of radius 0.25 m from the start, and everything in it
    can be approached to within 1 m.
    """
    pick = Pick(np.random.default_rng(seed), style)
    plan = draw_plan(pick)
    site = Site(plan)
    fittings = doors_and_windows(plan, pick)
    site.add_fixed(fittings)
    for index in range(len(plan.spaces)):
        furnish(Arranger(site, pick, index))
    complete(site, pick)
    hang_curtains(site, pick)
    things = [*bare_rooms(plan, pick), *fittings, *site.placed]
    lights, ambient = _light(pick, plan)
    rooms = tuple(Room(space.kind, space.inner) for space in plan.spaces)
    return _compile(
        f"apartment {seed} ({style.name})", things, rooms, (lights, ambient), _start(site)
    )


def _light(pick: Pick, plan: Plan) -> tuple[tuple[Light, ...], tuple[float, float, float]]:
    """One or two lamps under each ceiling, warm or cold, and light from nowhere."""
    lights = []
    for space in plan.spaces:
        x0, y0, x1, y1 = space.inner
        count = 2 if max(x1 - x0, y1 - y0) > 4.5 else 1
        warm = pick.between(-0.12, 0.12)
        for index in range(count):
            share = (index + 0.5) / count
            x = x0 + (x1 - x0) * (share if x1 - x0 > y1 - y0 else pick.between(0.4, 0.6))
            y = y0 + (y1 - y0) * (share if x1 - x0 <= y1 - y0 else pick.between(0.4, 0.6))
            power = pick.between(*pick.style.light)
            colour = (power * (1 + warm), power, power * (1 - warm))
            lights.append(Light((x, y, plan.height_m - 0.3), colour))
    level, tone = pick.between(*pick.style.ambient), pick.between(-0.04, 0.04)
    return tuple(lights), (level * (1 + tone), level, level * (1 - tone))


def _start(site: Site) -> tuple[float, float, float]:
    """The roomiest reachable place in the hub, looking along its longer side."""
    x0, y0, x1, y1 = site.plan.spaces[0].inner
    clearance = np.where(site.standable(), site.clearance(), 0.0)
    cells = np.stack(np.meshgrid(*map(np.arange, site.grid.shape), indexing="ij"), axis=-1)
    centres = site.grid.centres(cells)
    x, y = centres[..., 0], centres[..., 1]
    clearance[(x < x0) | (x > x1) | (y < y0) | (y > y1)] = 0.0
    best = np.unravel_index(int(clearance.argmax()), clearance.shape)
    along_x = x1 - x0 > y1 - y0
    here = centres[best]
    ahead = (x0 + x1) / 2 - here[0] if along_x else (y0 + y1) / 2 - here[1]
    yaw = (0.0 if along_x else np.pi / 2) + (0.0 if ahead >= 0 else np.pi)
    return (float(here[0]), float(here[1]), float(yaw))


def _compile(
    name: str,
    things: list[Placed],
    rooms: tuple[Room, ...],
    light: tuple[tuple[Light, ...], tuple[float, float, float]],
    start: tuple[float, float, float],
) -> Scene:
    """One scene out of placed models: transformed, concatenated, textures shared."""
    textures: dict[Material, int] = {}
    vertices: list[F64] = []
    faces, owners, materials, uv = [], [], [], []
    offset = 0
    for index, thing in enumerate(things):
        R = rotation("z", thing.turn)
        for mesh, material in thing.model.parts:
            vertices.append(mesh.vertices @ R.T + thing.at)
            faces.append(mesh.faces + offset)
            owners.append(np.full(len(mesh.faces), index))
            texture = textures.setdefault(material, len(textures))
            materials.append(np.full(len(mesh.faces), texture))
            uv.append(mesh.uv / material.tile_m)
            offset += len(mesh.vertices)
    images: tuple[U8, ...] = tuple(material.texture for material in textures)
    return Scene(
        name=name,
        vertices=np.concatenate(vertices).astype(np.float32),
        faces=np.concatenate(faces).astype(np.int32),
        face_object=np.concatenate(owners).astype(np.int32),
        face_texture=np.concatenate(materials).astype(np.int32),
        face_uv=np.concatenate(uv).astype(np.float32),
        textures=images,
        objects=tuple(SceneObject(t.model.category, rooms[t.space].kind) for t in things),
        lights=light[0],
        ambient=light[1],
        rooms=rooms,
        start=start,
    )
