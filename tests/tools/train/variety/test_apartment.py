"""Varied apartments: what changes, what stays, and where strangers stand."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from onemap_simulator.generation.apartment import FurnishedApartment
from onemap_simulator.generation.furniture.electronics import television
from onemap_simulator.generation.furniture.storage import wardrobe
from onemap_simulator.generation.furniture.tables import table
from onemap_simulator.generation.furniture.tableware import cup
from onemap_simulator.generation.mesh import box
from onemap_simulator.generation.model import Material, assemble
from onemap_simulator.generation.room_layout import PlacedModel, place
from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.generation.style import TRAINING
from onemap_simulator.scene.scene import PointLight, Room, Scene
from onemap_tools.train.variety.apartment import rescaled_scene, varied_scene, vary
from onemap_tools.train.variety.kinds import VALIDATION, VARIED, Variety
from onemap_tools.train.variety.strangers import STRANGER
from tests.simulator.scenes import box_room

PAINT = Material(np.full((64, 64, 3), 200, np.uint8))
# Everything happens, so that a test does not wait for chance.
ALWAYS = replace(
    VARIED,
    redesign=0.0,
    retexture=1.0,
    warp=1.0,
    soften=1.0,
    recombine=1.0,
    screen=1.0,
    no_ceiling=1.0,
)
NEVER = replace(
    VARIED,
    redesign=0.0,
    retexture=0.0,
    warp=0.0,
    soften=0.0,
    recombine=0.0,
    screen=0.0,
    no_ceiling=0.0,
    spread=0.0,
    part_spread=0.0,
    strangers=(0, 0),
)


@lru_cache(maxsize=1)
def room() -> FurnishedApartment:
    """A room of 6 x 5 m: two walls of one paint, ceiling, table with a cup, two wardrobes, TV."""
    sampler = Sampler(np.random.default_rng(0), TRAINING)
    board, mug = table(sampler), cup(sampler)
    top = board.support_surfaces[0].z
    shell = (
        ("wall", box((6, 0.1, 2.5), (3, -0.05, 0))),
        ("wall", box((6, 0.1, 2.5), (3, 5.05, 0))),
        ("ceiling", box((6, 5, 0.1), (3, 2.5, 2.5))),
        ("floor", box((6, 5, 0.02), (3, 2.5, -0.02))),
    )
    items = [place(assemble(name, (PAINT, [mesh])), (0, 0, 0), 0, 0) for name, mesh in shell]
    items += [
        place(board, (4.5, 1.2, 0), 0, 0),
        place(mug, (4.5, 1.2, top), 0, 0),
        place(wardrobe(sampler), (1.0, 4.6, 0), 0, 0),
        place(wardrobe(sampler), (3.0, 4.6, 0), 0, 0),
        place(television(sampler, hanging=True), (5.9, 3.5, 1.0), 270, 0),
    ]
    lights = (PointLight((3, 2.5, 2.2), (1.0, 1.0, 1.0)),)
    rooms = (Room("living room", (0.0, 0.0, 6.0, 5.0)),)
    return FurnishedApartment("room", tuple(items), rooms, lights, (0.5, 0.5, 0.5), (2.0, 2.0, 0.0))


def varied(variety: Variety, seed: int = 0) -> FurnishedApartment:
    return vary(room(), variety, np.random.default_rng(seed))


def only(apartment: FurnishedApartment, category: str) -> list[PlacedModel]:
    return [item for item in apartment.items if item.model.category == category]


def test_nothing_changes_but_the_light_where_nothing_may() -> None:
    apartment = varied(NEVER)
    for new, old in zip(apartment.items, room().items, strict=True):
        assert new.model.category == old.model.category
        np.testing.assert_allclose(new.box, old.box, atol=1e-9)
        assert [p.material for p in new.model.parts] == [p.material for p in old.model.parts]
    assert apartment.lights != room().lights


def test_what_shared_a_material_still_does_and_structure_keeps_its_shape() -> None:
    apartment = varied(ALWAYS)
    walls, before = only(apartment, "wall"), only(room(), "wall")
    paints = {id(part.material) for wall in walls for part in wall.model.parts}
    assert len(paints) == 1
    assert paints != {id(PAINT)}
    for new, old in zip(walls, before, strict=True):
        np.testing.assert_array_equal(new.box, old.box)
    assert only(apartment, "ceiling") == []


def test_furniture_changes_its_shape_and_what_carries_things_keeps_its_height() -> None:
    heights = {float(only(varied(ALWAYS, s), "wardrobe")[0].box[1, 2]) for s in range(4)}
    assert len(heights) == 4
    (board,) = only(room(), "table")
    for seed in range(4):
        (now,) = only(varied(ALWAYS, seed), "table")
        assert now.box[1, 2] == pytest.approx(board.box[1, 2])
        assert now.box[0, 2] == pytest.approx(0, abs=1e-9)


def test_other_designs_take_the_place_of_furniture() -> None:
    before = only(room(), "wardrobe")
    groups: set[int] = set()
    for seed in range(4):
        apartment = varied(replace(NEVER, redesign=1.0), seed)
        (mug,), (board,) = only(apartment, "cup"), only(apartment, "table")
        assert mug.position_m == only(room(), "cup")[0].position_m
        top = max(surface.z for surface in board.model.support_surfaces)
        assert top == pytest.approx(mug.position_m[2])
        for new, old in zip(only(apartment, "wardrobe"), before, strict=True):
            assert new.box[1, 1] == pytest.approx(old.box[1, 1])
            groups.add(len(new.model.parts))
    assert len(groups) >= 3


def test_a_television_shows_a_picture() -> None:
    def screen(apartment: FurnishedApartment) -> np.ndarray:
        parts = only(apartment, "television")[0].model.parts
        return next(p.material.texture for p in parts if len(p.mesh.faces) == 2)

    assert screen(room()).std() < 20
    assert np.mean([screen(varied(ALWAYS, seed)).std() for seed in range(4)]) > 20
    np.testing.assert_array_equal(screen(varied(NEVER)), screen(room()))


def test_strangers_stand_free_in_their_room_or_on_furniture() -> None:
    found = 0
    for seed in range(4):
        apartment = varied(replace(NEVER, strangers=(6, 6)), seed)
        furniture = [i for i in apartment.items if i.model.category in ("wardrobe", "table", "cup")]
        for thing in only(apartment, STRANGER):
            found += 1
            if thing.position_m[2] > 0:
                assert thing.position_m[2] == pytest.approx(only(room(), "cup")[0].position_m[2])
                continue
            assert thing.box[0, 2] == pytest.approx(0, abs=1e-6)
            assert (thing.box[0, :2] > 0).all()
            assert (thing.box[1, :2] < (6, 5)).all()
            for item in furniture:
                meets = (thing.box[0] < item.box[1]) & (thing.box[1] > item.box[0])
                assert not meets.all()
    assert found > 8


def test_a_varied_room_is_a_function_of_the_generator() -> None:
    first, again, other = (varied(ALWAYS, seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.items[4].box, again.items[4].box)
    assert first.lights == again.lights
    assert first.lights != other.lights


def test_a_rescaled_scene_grows_with_its_lights_rooms_and_start() -> None:
    scene = box_room()
    large = rescaled_scene(scene, 1.5)
    np.testing.assert_allclose(large.vertices, scene.vertices * 1.5)
    assert large.start == (scene.start[0] * 1.5, scene.start[1] * 1.5, scene.start[2])
    for new, old in zip(large.lights, scene.lights, strict=True):
        np.testing.assert_allclose(new.position_m, np.multiply(old.position_m, 1.5))
    bounds = [room.bounds_m for room in large.rooms]
    np.testing.assert_allclose(bounds, [np.multiply(room.bounds_m, 1.5) for room in scene.rooms])


@pytest.mark.slow
@pytest.mark.parametrize("variety", [VARIED, VALIDATION])
def test_an_apartment_of_a_seed_is_always_the_same(variety: Variety) -> None:
    def content(scene: Scene) -> bytes:
        return scene.vertices.tobytes() + b"".join(image.tobytes() for image in scene.textures)

    first, again = (varied_scene(901, variety) for _ in range(2))
    assert content(first) == content(again)
    assert STRANGER in first.categories
