"""Searches for described objects: the right one is found, the wrong one is set aside."""

from __future__ import annotations

import pytest

from onemap_planner.motion.motions import Pose2d
from onemap_shared.messages import Detail, Relation, RelationKind, SearchState
from tests.planner.grid_world import GridWorld, four_rooms, start

WRONG, RIGHT = (9.3, 3.0), (2.1, 7.0)  # the second is 0.4 m from the bed; from the plan's corner
BESIDE = Detail(relations=(Relation(RelationKind.NEXT_TO, ("bed",)),))


def world_with(*lamps: tuple[float, float]) -> GridWorld:
    """Four rooms with lamps; the robot is in the room with the table."""
    plan = four_rooms()
    for x, y in lamps:
        plan.put("lamp", x, y, 0.3)
    ox, oy = plan.grid.bounds_m[:2]
    return GridWorld(plan, Pose2d(ox + 1.0, oy + 1.0, 0.0))


def test_of_two_lamps_the_one_next_to_the_bed_is_found() -> None:
    world = world_with(WRONG, RIGHT)
    run = start(world, "lamp", detail=BESIDE)
    search = run.until_over(300.0)
    (result,) = search.results
    print(result, run.now_s, run.reasons)
    ox, oy = world.floor_plan.grid.bounds_m[:2]
    assert result.outcome is SearchState.FOUND
    assert result.position_m[:2] == pytest.approx(
        (ox + RIGHT[0] + 0.15, oy + RIGHT[1] + 0.15), abs=0.3
    )
    assert result.checks == ("0.3 m from the bed",)


def test_only_another_lamp_is_an_outcome_of_its_own() -> None:
    world = world_with(WRONG)
    run = start(world, "lamp", detail=BESIDE)
    search = run.until_over(600.0)
    (result,) = search.results
    print(result, run.now_s, run.reasons)
    assert result.outcome is SearchState.FOUND_OTHER
    assert result.reason == "found a lamp, but not next to a bed"
