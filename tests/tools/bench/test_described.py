"""Goals of which others of the kind are there: their truth by geometry, and the plain search."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from onemap_planner.policy.state import Evidence, FoundObject
from onemap_shared.messages import ObjectResult, SearchState
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.scene.scene import Room, Scene
from onemap_tools.bench.lockstep import (
    LockstepSimulation,
    PerceptionPipeline,
    SimulatedRobot,
    SystemConfig,
)
from onemap_tools.bench.navigation.benchmark import setups
from onemap_tools.bench.navigation.described import (
    PAINTS,
    DescribedObject,
    cells_of,
    described_objects,
    merged,
    painted,
)
from onemap_tools.bench.navigation.results import Failure, ResultsFolder, read_beside
from onemap_tools.bench.options import GoalsName, NavigationBench
from onemap_tools.demo.summary import ObjectSummary
from tests.planner.one_room import candidate
from tests.simulator.scenes import WALL_SIDES, SceneBuilder
from tests.tools.bench.test_results import OPTIONS, episode, failed, found

NOUNS = frozenset({"bed", "desk", "lamp", "stool", "dresser", "chair"})
FOUND = ObjectResult("lamp", SearchState.FOUND, "", (), 0.9, 7.0, 3.0, (1.0, 2.0), ())


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


def test_a_plain_search_that_goes_on_adds_up_and_is_compared_as_two(tmp_path: Path) -> None:
    second = replace(FOUND, start_xy_m=(5.0, 5.0), duration_s=20.0, path_length_m=11.0)
    (both,) = merged([FOUND, second])
    assert (both.start_xy_m, both.duration_s, both.path_length_m) == ((1.0, 2.0), 27.0, 14.0)
    assert merged([]) == ()
    wrong, right = failed("lamp", 3, Failure.WRONG_OBJECT), found("lamp", 7, 14)
    ResultsFolder(tmp_path, {**OPTIONS, "method": "plain"}).add(
        replace(episode(0, right), plain=(wrong,))
    )
    beside = read_beside(tmp_path, OPTIONS)
    assert [item.objects for (item,) in beside.values()] == [(wrong,), (right,)]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"method": "plain"}, "not with --goals names"),
        ({"method": "plain", "goals": "absent"}, "not with --goals absent"),
        ({"method": "oracle", "goals": "absent"}, "drives to what is there"),
        ({"goals": "colours"}, "--goals colours is for --features mini"),
        ({"method": "vlfm", "goals": "rooms"}, "--goals rooms is for onemap, plain, oracle"),
    ],
)
def test_methods_and_goals_that_do_not_fit_are_refused(options: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        setups(NavigationBench(**options))


def test_a_search_that_goes_on_rejects_what_was_found_whatever_the_map_says_of_it() -> None:
    config = SystemConfig(simulator=SimulatorConfig())
    robot = SimulatedRobot(two_rooms(), config.simulator)
    simulation = LockstepSimulation(robot, config, PerceptionPipeline(config.perception))
    simulation.search(("dresser",), 0.0)
    wrong, other = candidate(3.5, 2.3), candidate(9.1, 4.6)
    simulation.state = replace(
        simulation.state,
        evidence=Evidence(candidates=(wrong, other)),
        found_objects=(FoundObject("dresser", wrong.cells),),
    )
    covered = cells_of(two_rooms(), 6, 0.1)
    search, evidence = simulation.search_on(0.0, covered), simulation.state.evidence
    assert search.active
    assert evidence.candidates == (other,)
    assert {each.supported for each in evidence.rejected} == {True, False}
    assert {each.cells for each in evidence.rejected} == {wrong.cells | covered}
    assert {(30, 21), (39, 24)} <= covered
