"""Apartments with other materials and shapes, and with things that have no name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from onemap_simulator.generation.apartment import (
    FurnishedApartment,
    compile_scene,
    furnish_apartment,
)
from onemap_simulator.generation.model import Material, Model, Part
from onemap_simulator.generation.room_layout import PlacedModel, place
from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.scene.scene import STRUCTURE, PointLight, Scene
from onemap_tools.train.variety import shapes
from onemap_tools.train.variety.kinds import Variety
from onemap_tools.train.variety.pictures import photograph
from onemap_tools.train.variety.redesign import redesigned
from onemap_tools.train.variety.strangers import stranger
from onemap_tools.train.variety.surfaces import surface

PICTURED = frozenset({"television", "laptop", "picture"})  # categories whose panel shows a picture
PANEL_FACES = 2
TILE_M = (0.15, 1.6)  # size of a repeating texture
STANDING_M = 0.05  # what begins below stands on the floor
TRIES = 12  # places tried for a stranger
FLOOR_SIZE_M, TOP_SIZE_M = (0.2, 1.9), (0.07, 0.35)
NEAR_START_M = 0.6  # kept free around the start


def varied_scene(seed: int, variety: Variety) -> Scene:
    """The scene of a seed under a variety; a function of both."""
    rng = np.random.default_rng([seed, len(variety.name), 23])
    apartment = vary(furnish_apartment(seed, variety.style), variety, rng)
    return rescaled_scene(compile_scene(apartment), rng.uniform(*variety.scale))


def vary(
    apartment: FurnishedApartment, variety: Variety, rng: np.random.Generator
) -> FurnishedApartment:
    """The apartment with changed models and light, and strangers in it."""
    changer = _Changer(variety, rng, {})
    items = list(apartment.items)
    if rng.random() < variety.no_ceiling:
        items = [item for item in items if item.model.category != "ceiling"]
    anew = [_redesigned(item, items, variety, rng) for item in items]
    shaped = [_reshaped(item, anew, variety, rng) for item in anew]
    drawn = [replace(item, model=changer.redrawn(item.model)) for item in shaped]
    drawn += _strangers(apartment, drawn, changer)
    bright = float(np.exp(rng.uniform(*variety.exposure)))
    lights = tuple(
        _dimmed(light, bright * rng.uniform(0.3, 1.3), rng) for light in apartment.lights
    )
    red, green, blue = (bright * level for level in apartment.ambient)
    return replace(apartment, items=tuple(drawn), lights=lights, ambient=(red, green, blue))


def rescaled_scene(scene: Scene, factor: float) -> Scene:
    """Everything larger or smaller by a factor, but the camera that will look at it."""
    lights = tuple(
        replace(light, position_m=_scaled(light.position_m, factor)) for light in scene.lights
    )
    rooms = []
    for room in scene.rooms:
        x0, y0, x1, y1 = (factor * side for side in room.bounds_m)
        rooms.append(replace(room, bounds_m=(x0, y0, x1, y1)))
    x, y, yaw = scene.start
    return replace(
        scene,
        vertices=(scene.vertices * np.float32(factor)).astype(np.float32),
        lights=lights,
        rooms=tuple(rooms),
        start=(x * factor, y * factor, yaw),
    )


@dataclass(frozen=True, slots=True)
class _Changer:
    """Redraws materials; what shared a material before shares it afterwards.

    ``drawn``: new materials by the id of the old one, beside the old one, which keeps its id.
    """

    variety: Variety
    rng: np.random.Generator
    drawn: dict[int, tuple[Material, Material]]

    def redrawn(self, model: Model) -> Model:
        """The model with some materials and pictures redrawn."""
        parts = tuple(Part(p.mesh, self._material(model.category, p)) for p in model.parts)
        return replace(model, parts=parts)

    def new(self) -> Material:
        """A material of any family of the variety."""
        families = self.variety.surfaces
        family = families[int(self.rng.integers(len(families)))]
        tile_m = float(np.exp(self.rng.uniform(*np.log(TILE_M))))
        return Material(surface(family, self.rng), tile_m)

    def _material(self, category: str, part: Part) -> Material:
        old = part.material
        if id(old) not in self.drawn:
            self.drawn[id(old)] = (old, self._replacement(category, part))
        return self.drawn[id(old)][1]

    def _replacement(self, category: str, part: Part) -> Material:
        if len(part.mesh.faces) == PANEL_FACES:  # shows one whole image
            shows = category in PICTURED and self.rng.random() < self.variety.screen
            return Material(photograph(self.rng)) if shows else part.material
        return self.new() if self.rng.random() < self.variety.retexture else part.material


def _redesigned(
    item: PlacedModel, items: Sequence[PlacedModel], variety: Variety, rng: np.random.Generator
) -> PlacedModel:
    """The item in another design of its category, now and then."""
    makers = variety.designs.get(item.model.category, ())
    if not makers or rng.random() >= variety.redesign:
        return item
    levels = [other.position_m[2] - item.position_m[2] for other in _carried(item, items)]
    model = redesigned(
        item.model,
        makers,
        Sampler(rng, variety.style),
        carried_z=levels,
        on_floor=item.position_m[2] < STANDING_M,
    )
    return place(model, item.position_m, item.yaw_deg, item.space)


def _reshaped(
    item: PlacedModel, items: Sequence[PlacedModel], variety: Variety, rng: np.random.Generator
) -> PlacedModel:
    """The item in another shape; what carries other things keeps its height."""
    model = item.model
    if model.category in STRUCTURE:
        return item
    if rng.random() < variety.recombine:
        kin = [i.model for i in items if i.model.category == model.category and i is not item]
        if kin:
            model = shapes.recombined(model, kin[int(rng.integers(len(kin)))], rng)
    model = shapes.with_part_sizes(model, rng, variety.part_spread)
    carries = bool(model.support_surfaces and _carried(item, items))
    model = shapes.rescaled(model, rng, variety.spread, upright=not carries)
    if not carries and rng.random() < variety.warp:
        model = shapes.warped(model, rng, variety.warps[int(rng.integers(len(variety.warps)))])
    if rng.random() < variety.soften:
        model = shapes.softened(model, rng)
    return place(model, item.position_m, item.yaw_deg, item.space)


def _carried(item: PlacedModel, items: Sequence[PlacedModel]) -> list[PlacedModel]:
    """What stands on the item."""
    lower, upper = item.box
    return [
        other
        for other in items
        if other.space == item.space
        and other.position_m[2] - item.position_m[2] > STANDING_M
        and other.position_m[2] <= upper[2] + STANDING_M
        and lower[0] <= other.position_m[0] <= upper[0]
        and lower[1] <= other.position_m[1] <= upper[1]
    ]


def _strangers(
    apartment: FurnishedApartment, items: Sequence[PlacedModel], changer: _Changer
) -> list[PlacedModel]:
    """Things without a name on free floor and on furniture."""
    rng = changer.rng
    furniture = [item for item in items if item.model.category not in STRUCTURE]
    parts = [part for item in furniture for part in item.model.parts]
    tops = [item for item in furniture if item.model.support_surfaces]
    low, high = changer.variety.strangers
    placed: list[PlacedModel] = []
    for _ in range(int(rng.integers(low, high + 1))):
        top = tops[int(rng.integers(len(tops)))] if tops and rng.random() < 0.4 else None
        size_m = _size(rng, FLOOR_SIZE_M if top is None else TOP_SIZE_M)
        model = stranger(rng, size_m, parts, changer.new)
        boxes = np.stack([item.box for item in (*furniture, *placed)])
        found = _on_floor(apartment, model, boxes, rng) if top is None else _on(top, model, rng)
        if found is not None:
            placed.append(found)
    return placed


def _size(rng: np.random.Generator, limits: tuple[float, float]) -> tuple[float, float, float]:
    """Width, depth and height in metres around a random size."""
    size = np.exp(rng.uniform(*np.log(limits)))
    width, depth, height = np.clip(size * np.exp(rng.uniform(-0.7, 0.3, 3)), 0.03, limits[1])
    return float(width), float(depth), float(height)


def _on_floor(
    apartment: FurnishedApartment, model: Model, boxes: np.ndarray, rng: np.random.Generator
) -> PlacedModel | None:
    """In a random room where it meets no box (N, 2, 3), None if no place tried is free."""
    for _ in range(TRIES):
        space = int(rng.integers(len(apartment.rooms)))
        x0, y0, x1, y1 = apartment.rooms[space].bounds_m
        at = (float(rng.uniform(x0, x1)), float(rng.uniform(y0, y1)), 0.0)
        item = place(model, at, float(rng.uniform(0, 360)), space)
        inside = item.box[0, 0] > x0 and item.box[0, 1] > y0
        inside = inside and item.box[1, 0] < x1 and item.box[1, 1] < y1
        meets = (boxes[:, 0] < item.box[1]) & (boxes[:, 1] > item.box[0])
        apart = np.hypot(at[0] - apartment.start[0], at[1] - apartment.start[1])
        reach = np.hypot(*(item.box[1, :2] - item.box[0, :2])) / 2
        if inside and not meets.all(axis=1).any() and apart > reach + NEAR_START_M:
            return item
    return None


def _on(top: PlacedModel, model: Model, rng: np.random.Generator) -> PlacedModel:
    """Somewhere on the item; may stand in what is there already."""
    surface = top.model.support_surfaces[int(rng.integers(len(top.model.support_surfaces)))]
    local = np.array(
        [
            rng.uniform(surface.x_min, surface.x_max),
            rng.uniform(surface.y_min, surface.y_max),
            surface.z,
        ]
    )
    turn = np.radians(top.yaw_deg)
    x = top.position_m[0] + np.cos(turn) * local[0] - np.sin(turn) * local[1]
    y = top.position_m[1] + np.sin(turn) * local[0] + np.cos(turn) * local[1]
    at = (float(x), float(y), float(top.position_m[2] + local[2]))
    return place(model, at, float(rng.uniform(0, 360)), top.space)


def _dimmed(light: PointLight, factor: float, rng: np.random.Generator) -> PointLight:
    """The light at another strength and colour temperature."""
    warm = rng.uniform(-0.2, 0.2)
    red, green, blue = light.colour
    return replace(
        light, colour=(red * factor * (1 + warm), green * factor, blue * factor * (1 - warm))
    )


def _scaled(position_m: tuple[float, float, float], factor: float) -> tuple[float, float, float]:
    x, y, z = position_m
    return (x * factor, y * factor, z * factor)
