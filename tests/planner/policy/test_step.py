"""Whole searches in a simulated world of cells, with simulated time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.motion.motions import Pose2d, Reverse
from onemap_planner.search.state_machine import Approaching, Exploring, Finished, LookingAround
from onemap_shared.messages import (
    After,
    Detail,
    KeptObject,
    Occupancy,
    Relation,
    RelationKind,
    SearchState,
)
from tests.planner import grid_world
from tests.planner.grid_world import in_plan, one_room, start, two_rooms


def results(run: grid_world.SimulatedSearch) -> list[SearchState]:
    return [result.outcome for result in run.state.search.results]


def test_it_looks_around_and_sets_out() -> None:
    run = grid_world.start(grid_world.in_four_rooms(), "vase")
    while run.now_s < 12.0:
        run.step()
    assert run.reasons[0] == "looking around for a vase"
    assert run.world.odometer_m > 1.5  # at the speed of a touch it was 0.2 m
    assert not run.state.search.slow


@pytest.mark.slow
def test_a_missing_object_is_not_found_after_everything_was_explored() -> None:
    world = grid_world.in_two_rooms()
    run = grid_world.start(world, "unicorn", "table")
    run.until_over(400.0)
    assert results(run) == [SearchState.NOT_FOUND, SearchState.FOUND]
    assert "searched everything reachable" in run.state.search.results[0].reason
    assert run.state.search.phase == Finished(SearchState.NOT_FOUND)
    floor = ~world.floor_plan.solid
    assert (world.occupancy[floor] == Occupancy.FREE).mean() > 0.97
    assert not world.entered_solid


def test_a_missing_map_fails_the_search_with_the_reason() -> None:
    run = grid_world.start(grid_world.in_four_rooms(), "sofa")
    run.stale_reason = "the mapper is not there"
    search = run.until_over(60.0)
    assert search.phase == Finished(SearchState.FAILED)
    assert search.reason.endswith("(the mapper is not there)")
    assert 30.0 <= run.now_s < 32.0


def test_patience_begins_when_no_stage_starts_any_more_but_not_for_ever() -> None:
    run = grid_world.start(grid_world.in_four_rooms(), "sofa")
    run.stale_reason = "the mapper is compiling"
    while run.now_s < 100.0:
        run.patience_from_s = run.now_s
        run.step()
    assert run.until_over(400.0).reason.endswith("(the mapper is compiling)")
    assert 130.0 <= run.now_s < 132.0
    run = grid_world.start(grid_world.in_four_rooms(), "sofa")
    run.stale_reason, run.patience_from_s = "the mapper is compiling", 1e9
    run.until_over(400.0)
    assert 300.0 <= run.now_s < 302.0


@pytest.mark.slow
def test_a_restarted_mapper_makes_it_look_around_again() -> None:
    run = grid_world.start(grid_world.in_two_rooms(), "bed")
    while run.world.odometer_m < 2.0:
        run.step()
    assert isinstance(run.state.search.phase, Exploring)
    run.world.forget()
    run.step()
    assert isinstance(run.state.search.phase, LookingAround)
    assert "began anew" in run.state.search.reason


class Glass(grid_world.GridWorld):
    """A world whose camera does not see one wall of glass across the room."""

    def _touches(self, x: float, y: float) -> bool:
        left = self.floor_plan.grid.bounds_m[0]
        return super()._touches(x, y) or abs(x - (left + 3.0)) < 0.2


@pytest.mark.slow
def test_a_wall_that_no_map_shows_does_not_block_the_search_for_ever() -> None:
    floor_plan = grid_world.FloorPlan(np.zeros((60, 40), bool))
    for wall in ((0, 0, 6, 0.1), (0, 3.9, 6, 4), (0, 0, 0.1, 4), (5.9, 0, 6, 4)):
        floor_plan.wall(*wall)
    floor_plan.put("vase", 5.3, 1.9, 0.3)
    ox, oy = floor_plan.grid.bounds_m[:2]
    run = grid_world.start(Glass(floor_plan, Pose2d(ox + 1.0, oy + 2.0, 0.0)), "vase")
    reversed_once = False
    while run.state.search.active and run.now_s < 300.0:
        run.step()
        reversed_once |= run.decision is not None and isinstance(run.decision.motion, Reverse)
    assert reversed_once
    assert not run.state.search.active
    assert run.state.search.phase != Finished(SearchState.FOUND)
    assert run.state.search.reason


@pytest.mark.slow
def test_a_look_alike_that_the_detector_does_not_confirm_is_left() -> None:
    world = grid_world.in_one_room()
    run = grid_world.start(world, "table")
    while not isinstance(run.state.search.phase, Approaching) and run.now_s < 60.0:
        run.step()
    world.floor_plan.things.clear()  # the detector changes its mind; the map still looks like it
    search = run.until_over(400.0)
    assert search.phase == Finished(SearchState.NOT_FOUND)
    assert run.state.search.results[0].position_m == ()


def test_the_time_limit_of_an_object() -> None:
    run = grid_world.start(grid_world.in_four_rooms(), "sofa", "table")
    explore = run.config.explore.model_copy(update={"object_limit_s": 9.0})
    run.config = run.config.model_copy(update={"explore": explore})
    run.until_over(60.0)
    assert results(run)[0] is SearchState.FAILED
    assert "limit" in run.state.search.results[0].reason


def test_it_drives_back_to_where_it_set_out() -> None:
    world = in_plan(two_rooms())
    began = world.pose.xy
    run = start(world, "bed")
    run.state = replace(run.state, search=replace(run.state.search, after=After.RETURN))
    search = run.until_over(400.0)
    assert search.phase == Finished(SearchState.FOUND)
    assert search.reason == "found 1 of 1; back where it set out"
    assert world.pose.distance_to(began) < 0.4
    assert search.returned_m > 2.0


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


def test_a_bed_that_the_map_keeps_of_an_earlier_search_is_an_anchor() -> None:
    plan = one_room()
    plan.put("lamp", *WRONG, 0.3)
    world = in_plan(plan)
    run = start(world, "lamp", detail=BESIDE)
    ox, oy = world.floor_plan.grid.bounds_m[:2]
    x, y = ox + WRONG[0] + 0.15, oy + WRONG[1] + 0.6
    extent_m = (x - 0.2, y - 0.2, x + 0.2, y + 0.2)
    run.finds = (KeptObject("a", "bed", (x, y, 0.4), extent_m, 0.9, 1, "before", 1, 1),)
    (result,) = run.until_over(300.0).results
    assert result.outcome is SearchState.FOUND


def test_only_another_lamp_is_an_outcome_of_its_own() -> None:
    plan = one_room()
    plan.put("lamp", *WRONG, 0.3)
    run = start(in_plan(plan), "lamp", detail=BESIDE)
    search = run.until_over(300.0)
    (result,) = search.results
    assert result.outcome is SearchState.FOUND_OTHER
    assert result.reason == "found a lamp, but not next to a bed: the nearest is 3.0 m away"
    (passed,) = search.passed
    assert passed.reason.startswith("not next to a bed: the nearest is")
    assert passed.position_m == pytest.approx(result.position_m[:2], abs=0.3)


def test_a_search_whose_time_is_over_tells_what_it_left_aside() -> None:
    plan = one_room()
    plan.put("lamp", *WRONG, 0.3)
    run = start(in_plan(plan), "lamp", detail=BESIDE)
    while not run.state.search.passed and run.now_s < 60.0:
        run.step()
    explore = run.config.explore.model_copy(update={"object_limit_s": 1.0})
    run.config = run.config.model_copy(update={"explore": explore})
    (result,) = run.until_over(60.0).results
    assert result.reason.startswith("not found within 1 s, the limit for one object; left aside: ")
    assert "(not next to a bed" in result.reason


def test_a_height_that_nothing_tells_ends_as_another_lamp() -> None:
    """The detector never sees the bed that the lamp lies on."""
    plan = one_room()
    plan.put("lamp", 0.8, 2.2, 0.3)
    on_bed = Detail(relations=(Relation(RelationKind.ON, ("bed",)),))
    (result,) = start(in_plan(plan), "lamp", detail=on_bed).until_over(300.0).results
    assert result.outcome is SearchState.FOUND_OTHER
    why = "perhaps not on a bed: the height of the bed is not known"
    assert result.reason == f"found a lamp, but {why}"
