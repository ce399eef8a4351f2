"""Searches for described objects: the right one is found, the wrong one is set aside."""

from __future__ import annotations

import pytest

from onemap_shared.messages import Detail, Relation, RelationKind, SearchState
from tests.planner.grid_world import in_plan, one_room, start, two_rooms

RIGHT = (2.1, 7.0)  # 0.4 m from the bed in the other room; from the plan's corner
WRONG = (4.3, 0.3)
BESIDE = Detail(relations=(Relation(RelationKind.NEXT_TO, ("bed",)),))


def test_of_two_lamps_the_one_next_to_the_bed_is_found() -> None:
    plan = two_rooms()
    for x, y in (WRONG, RIGHT):
        plan.put("lamp", x, y, 0.3)
    world = in_plan(plan)
    run = start(world, "lamp", detail=BESIDE)
    search = run.until_over(300.0)
    (result,) = search.results
    ox, oy = world.floor_plan.grid.bounds_m[:2]
    assert result.outcome is SearchState.FOUND
    assert result.position_m[:2] == pytest.approx(
        (ox + RIGHT[0] + 0.15, oy + RIGHT[1] + 0.15), abs=0.3
    )
    assert result.checks == ("0.3 m from the bed",)


def test_only_another_lamp_is_an_outcome_of_its_own() -> None:
    plan = one_room()
    plan.put("lamp", *WRONG, 0.3)
    run = start(in_plan(plan), "lamp", detail=BESIDE)
    search = run.until_over(300.0)
    (result,) = search.results
    assert result.outcome is SearchState.FOUND_OTHER
    assert result.reason == "found a lamp, but not next to a bed"
