"""Openings in the floor of a scene: floor is missing there, all else stays as it was."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.stairwell import DEPTH_M, floor_around, with_stairwell
from onemap_simulator.parts import scene_truth
from onemap_simulator.physics.missing_floor import MissingFloor
from tests.simulator.scenes import box_room

OPENING = (1.5, 1.0, 2.2, 2.0)


def test_floor_is_missing_in_the_opening_alone() -> None:
    floor = MissingFloor.of(with_stairwell(box_room(), OPENING), 1.1)
    assert floor.touches(1.85, 1.5, 0.01)
    assert not floor.touches(1.25, 1.5, 0.2)


def test_all_else_of_the_scene_stays() -> None:
    room = box_room()
    opened = with_stairwell(room, OPENING)
    assert opened.objects == room.objects
    things = opened.face_object != floor_around(room, OPENING)
    before = room.vertices[room.faces[room.face_object != floor_around(room, OPENING)]]
    np.testing.assert_array_equal(opened.vertices[opened.faces[things]], before)
    assert opened.vertices[:, 2].min() == pytest.approx(-DEPTH_M - 0.02)


def test_two_openings_need_two_floors() -> None:
    opened = with_stairwell(box_room(), OPENING)
    assert floor_around(opened, (3.0, 1.0, 3.4, 1.4)) is None
    with pytest.raises(ValueError, match="no floor around the opening"):
        with_stairwell(opened, (3.0, 1.0, 3.4, 1.4))
    with pytest.raises(ValueError, match="no floor around the opening"):
        with_stairwell(box_room(), (3.5, 1.0, 4.5, 2.0))


def test_the_shortest_way_leads_around_an_opening() -> None:
    scene, config = generate_apartment(2), SimulatorConfig(seed=2)
    opened = with_stairwell(scene, (4.5, 4.9, 5.2, 5.9))
    before, after = (scene_truth(each, config) for each in (scene, opened))
    way = before.shortest_path("sofa", 2.3, 5.43)
    inside = (way >= (4.5, 4.9)).all(axis=1) & (way <= (5.2, 5.9)).all(axis=1)
    assert inside.any()
    around = after.shortest_path("sofa", 2.3, 5.43)
    assert not ((around >= (4.35, 4.75)).all(axis=1) & (around <= (5.35, 6.05)).all(axis=1)).any()
    assert after.distances("sofa", 2.3, 5.43).path_m > before.distances("sofa", 2.3, 5.43).path_m
