"""Goals of which others of the kind are there: their truth by geometry."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from onemap_simulator.config import SimulatorConfig
from onemap_simulator.scene.scene import Room, Scene
from onemap_tools.bench.navigation.benchmark import setups
from onemap_tools.bench.navigation.described import (
    PAINTS,
    DescribedObject,
    described_objects,
    painted,
)
from onemap_tools.bench.options import GoalsName, NavigationBench
from onemap_tools.judgement import ObjectSummary
from tests.simulator.scenes import WALL_SIDES, SceneBuilder

NOUNS = frozenset({"bed", "desk", "lamp", "stool", "dresser", "chair"})


def two_rooms() -> Scene:
    """A bedroom and a kitchen of 5 x 5 m with a wall between, and a lamp at the bed.

    The stool stands behind the wall at the bed; the dressers are near the bed and far from it, with
    a lamp on the far one; of the chairs at the desk two are next to it.
    """
    builder = SceneBuilder().add("floor", (0, 0, 0), (10, 5, 2.5), sides=("z-", *WALL_SIDES))
    builder.add("wall", (4.9, 0, 0), (5.1, 4, 2.5))
    builder.add("bed", (2.5, 0.2, 0), (4.5, 1.2, 0.5))
    builder.add("lamp", (2.0, 0.2, 0), (2.2, 0.4, 1.5))  # 3: 0.3 m from the bed
    builder.add("stool", (5.2, 0.2, 0), (5.6, 0.6, 0.5))  # 0.7 m from it, behind the wall
    builder.add("stool", (8.0, 0.2, 0), (8.4, 0.6, 0.5))
    builder.add("dresser", (3.0, 2.1, 0), (4.0, 2.5, 0.9))  # 6: 0.9 m from the bed
    builder.add("dresser", (8.6, 4.4, 0), (9.6, 4.8, 0.9))  # 7
    builder.add("lamp", (9.0, 4.5, 0.9), (9.2, 4.7, 1.3))  # 8: on it
    builder.add("desk", (7.0, 2.0, 0), (8.0, 2.6, 0.7))
    for x in (6.4, 8.2, 5.2):
        builder.add("chair", (x, 2.0, 0), (x + 0.4, 2.4, 0.9))
    rooms = (Room("bedroom", (0, 0, 4.9, 5)), Room("kitchen", (5.1, 0, 10, 5)))
    return replace(builder.build(rooms=rooms), start=(1.0, 3.0, 0.0))


def described(goals: GoalsName) -> dict[str, DescribedObject]:
    every = described_objects(two_rooms(), SimulatorConfig(), goals, NOUNS)
    return {each.phrase: each for each in every}


def test_relations_hold_of_one_instance_only_by_the_geometry() -> None:
    every = {phrase: each.meant for phrase, each in described("relations").items()}
    # No stool is next to the bed: walls count. Two chairs are next to the desk: none is meant.
    assert every == {
        "lamp next to the bed": 3,
        "dresser next to the bed": 6,
        "lamp on the dresser": 8,
        "dresser under the lamp": 7,
    }


def test_rooms_are_named_by_a_free_place_in_them() -> None:
    every = described("rooms")
    assert every["lamp in the bedroom"].meant == 3
    assert every["lamp in the kitchen"].meant == 8
    assert not any("stool" in phrase or "chair" in phrase for phrase in every)
    (place,) = every["dresser in the kitchen"].places
    assert place.name in every["dresser in the kitchen"].detail.inside
    assert 5.1 < place.inside_m[0] < 10


def test_instances_of_a_class_are_painted_in_the_colours_by_which_they_are_named() -> None:
    scene = painted(two_rooms(), SimulatorConfig().seed)
    every = described("colours")
    nouns = sorted(each.noun for each in every.values())
    assert nouns == ["chair", "dresser", "dresser", "stool", "stool"]  # two chairs are close
    for each in every.values():
        (texture,) = set(scene.face_texture[scene.face_object == each.meant].tolist())
        assert tuple(scene.textures[texture][0, 0]) == PAINTS[each.detail.colour]


def test_a_claim_of_another_one_is_wrong_however_near_the_right_one() -> None:
    lamp, scene = described("relations")["lamp next to the bed"], two_rooms()
    claim = ObjectSummary("", "found", "", (2.1, 0.5, 1.0), 9.0, 6.0, 3.0, 1.0, 0.0)
    assert lamp.judged(scene, claim).success
    other = lamp.judged(scene, replace(claim, position_m=(9.0, 4.3, 1.0)))
    assert other.claimed_wrongly
    assert not other.success
    assert lamp.marked(scene).objects[3].category == "lamp next to the bed"


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"goals": "colours"}, "--goals colours is for --features mini"),
        ({"method": "vlfm", "goals": "rooms"}, "--goals rooms is for onemap, oracle"),
    ],
)
def test_methods_and_goals_that_do_not_fit_are_refused(options: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        setups(NavigationBench(**options))
