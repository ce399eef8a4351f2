"""Exploration selects candidates, keeps or abandons its goal, and ends without one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.motion.motions import Drive, Pose2d
from onemap_planner.motion.pure_pursuit import LOOK_AROUND_RADPS
from onemap_planner.policy.choose import select_candidate
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.policy.goals import Goal, GoalKind
from onemap_planner.policy.ledger import MAX_VISITS
from onemap_planner.policy.state import SETTLE_S, Evidence, PlannerState
from onemap_planner.policy.viewpoints import find_viewpoint
from onemap_planner.search.state_machine import (
    CandidateSelected,
    Ending,
    Event,
    EventStamp,
    Rejected,
)
from onemap_planner.sentences import DOUBTED, OBSTACLE, ONWARD
from onemap_planner.world.candidates import ObjectCandidate, ViewpointTally
from onemap_planner.world.costmap import BesideMap
from onemap_planner.world.description import Description
from onemap_shared.messages import (
    NO_ROOM,
    Detail,
    MapPlaces,
    Occupancy,
    Place,
    Relation,
    RelationKind,
)
from onemap_shared.places import NOWHERE, polygon_mask
from tests.planner.drawn_maps import PARAMS, drawn_map, search_view_of
from tests.planner.one_room import (
    SEARCH,
    candidate,
    context,
    context_of,
    explored,
    planner_state,
    rejecting,
    without,
)

HALF_KNOWN = context_of(search_view_of(drawn_map(*["......    "] * 10, scale=5)))
BEYOND = (4.25, 5.25)  # of a thing that was seen 2 m beyond the known floor
ROWS = ["#######", *["#......     "] * 7, "#......   # ", *["#......     "] * 2, "#######"]
SEEN_BEYOND = context_of(search_view_of(drawn_map(*[row.ljust(12) for row in ROWS], scale=5)))
GIVE_UP_S = SETTLE_S + 2 * np.pi / LOOK_AROUND_RADPS + 0.1


@pytest.mark.parametrize(
    ("sightings", "contradictions", "selected"),
    [
        pytest.param(3, 0, True, id="seen often enough"),
        pytest.param(2, 0, False, id="not often enough"),
        pytest.param(3, 3, True, id="another name as often"),
        pytest.param(3, 4, False, id="another name more often"),
    ],
)
def test_a_candidate_is_selected_by_its_sightings(
    sightings: int, contradictions: int, selected: bool
) -> None:
    seen = replace(candidate(2.5, 2.5, sightings), contradictions=contradictions)
    event = select_candidate(planner_state(seen), context())
    assert event == (CandidateSelected(seen) if selected else None)


def doubtful(rank: float, hits: int) -> tuple[PlannerState, PlanningContext]:
    """A state with a candidate that the map does not support, and a room all of which is known."""
    thing = replace(
        candidate(2.5, 2.5, 4), supported=False, near_views=(ViewpointTally((0.5, 3.5), hits, 10),)
    )
    plain = context()
    guidance = np.full_like(plain.map_view.guidance, rank)
    state = replace(PlannerState(SEARCH), evidence=Evidence(unsupported=(thing,)))
    return state, replace(plain, map_view=replace(plain.map_view, guidance=guidance))


def test_what_the_map_does_not_support_is_looked_at_from_near() -> None:
    state, here = doubtful(rank=0.95, hits=8)
    state, motion, event, _ = explored(state, here)
    goal = state.active_goal
    assert goal is not None
    assert goal.goal.kind is GoalKind.DETECTION
    assert goal.goal.doing == DOUBTED
    assert isinstance(motion, Drive)
    assert event is None
    there = replace(here, pose=Pose2d(*goal.goal.viewpoint_xy, facing(goal.goal)))
    _, _, event, _ = explored(state, there)
    assert event == CandidateSelected(state.evidence.unsupported[0])


def test_what_the_map_does_not_support_and_is_another_one_waits_until_nothing_else_is_left() -> (
    None
):
    state, here = doubtful(rank=0.95, hits=8)
    nowhere = np.zeros_like(here.map_view.similarity)
    detail = Detail(relations=(Relation(RelationKind.NEXT_TO, ("bed",)),))
    here = replace(here, description=Description(detail, {"bed": nowhere}, None, NOWHERE, {}, {}))
    state = replace(state, search=replace(SEARCH, details=(detail,) * len(SEARCH.objects)))
    state, motion, *_ = explored(state, here)
    assert state.active_goal is None
    assert not isinstance(motion, Drive)
    state, event = given_up(state, here)
    for _ in range(2):  # reconsidered, then taken all the same
        state, *_ = explored(replace(state, active_time_s=state.active_time_s + GIVE_UP_S), here)
    state, motion, *_ = explored(state, here)
    assert event is None
    assert state.evidence.takes_any
    assert isinstance(motion, Drive)


@pytest.mark.parametrize(
    ("low_m", "high_m", "looks"),
    [
        pytest.param((4.3, 0.9), (5.3, 2.9), (4.5, 5.3), id="its border"),
        pytest.param((1.0, 1.0), (2.0, 2.0), None, id="all of it is seen"),
        pytest.param((9.0, 9.0), (9.5, 9.5), (-0.3, 2.0), id="no way leads there"),
    ],
)
def test_what_is_in_a_place_is_looked_for_there(
    low_m: tuple[float, float], high_m: tuple[float, float], looks: tuple[float, float] | None
) -> None:
    """looks: least and largest x of where the robot looks, which is at the left."""
    (x0, y0), (x1, y1) = low_m, high_m
    corners_m = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
    shown = {"den": polygon_mask(corners_m, HALF_KNOWN.map_view.grid)}
    description = Description(Detail(inside=("den",)), {}, None, NOWHERE, shown, shown)
    state, _, event, _ = explored(planner_state(), replace(HALF_KNOWN, description=description))
    assert event is None
    if looks is None:
        assert state.active_goal is None
    else:
        assert state.active_goal is not None
        assert looks[0] <= state.active_goal.goal.look_xy[0] <= looks[1]


@pytest.mark.parametrize("detail", [Detail(inside=("study",)), Detail(outside=("kitchen",))])
def test_walls_that_tell_what_room_a_candidate_is_in_are_looked_at_first(detail: Detail) -> None:
    """It is in the first room; the point of the name is seen through a door, its walls are not.
    The map shows no kitchen: what is in the study is not in it."""
    rows = ["#" * 8, *["#......#"] * 5, "#  ..  #", *["   ..   "] * 3, " " * 8]
    alike = np.full((55, 40), 0.1, np.float32)
    alike[20, 30] = 0.8
    here = context_of(search_view_of(drawn_map(*rows, scale=5, similarity=alike)))
    grid, free = here.map_view.grid, here.map_view.occupancy == Occupancy.FREE
    x_m = grid.centres(np.argwhere(np.ones(grid.shape))).reshape(*grid.shape, 2)[..., 0]
    parts = np.select([free & (x_m < 3.0), free & (x_m > 3.5)], [1, 2], NO_ROOM).astype(np.int32)
    ids = np.where(free, 0, NO_ROOM).astype(np.int32)
    study = Place("study", inside_m=(4.25, 2.0))
    places = MapPlaces(1, 1, (study,), (0,), grid, ids, parts=parts)
    there = candidate(2.0, 3.0)
    masks = ({"study": free}, {"study": parts == 2}) if detail.inside else ({}, {})
    here = replace(here, description=Description(detail, {}, None, places, *masks))
    state = replace(PlannerState(SEARCH), evidence=Evidence(unclear=(there,)))
    kinds: list[GoalKind] = []
    looks: list[tuple[float, float]] = []
    while not kinds or kinds[-1] is GoalKind.OUTLINE:
        after, *_ = explored(state, here)
        assert after.active_goal is not None
        goal = after.active_goal.goal
        kinds.append(goal.kind)
        looks.append(goal.look_xy)
        state = without(state, goal)
    assert 1 <= kinds.count(GoalKind.OUTLINE) <= 10  # then other goals, though it is not settled
    assert 3.0 <= looks[0][0] <= 3.5


def given_up(state: PlannerState, here: PlanningContext) -> tuple[PlannerState, Event | None]:
    """The state and the event after no goal was left for long enough."""
    state, *_ = explored(state, here)
    later = replace(state, active_time_s=state.active_time_s + GIVE_UP_S)
    after, _, event, _ = explored(later, here)
    return after, event


@pytest.mark.parametrize(("hits", "again"), [(8, True), (1, False)])
def test_before_not_found_what_is_doubtful_is_looked_at_once_more(hits: int, again: bool) -> None:
    state, here = doubtful(rank=0.95, hits=hits)
    (thing,) = state.evidence.unsupported
    state = replace(state, evidence=Evidence(rejected=(thing,)))
    state, event = given_up(state, here)
    assert event is None
    assert state.evidence.unsupported == ((thing,) if again else ())
    state, motion, event, _ = explored(state, here)
    assert isinstance(motion, Drive) is again
    state = rejecting(state, thing)
    _, event = given_up(state, here)
    assert isinstance(event, Ending)  # one more look, not one after the other


def facing(goal: Goal) -> float:
    (x, y), (look_x, look_y) = goal.viewpoint_xy, goal.look_xy
    return math.atan2(look_y - y, look_x - x)


def chosen(state: PlannerState) -> Goal:
    after, *_ = explored(state, SEEN_BEYOND)
    assert after.active_goal is not None
    return after.active_goal.goal


def test_a_candidate_beyond_the_known_floor_is_driven_towards() -> None:
    there = replace(candidate(*BEYOND), similarity=0.95)
    assert find_viewpoint(there, SEEN_BEYOND) is None
    assert chosen(planner_state()).look_xy[0] < 3.0  # the nearest part of the border
    goal = chosen(planner_state(there))
    assert goal.kind is GoalKind.FRONTIER
    assert goal.look_xy[0] > 3.0
    assert (goal.doing, goal.utility.score) == (ONWARD, 0.95)
    assert goal.utility.travel_m == pytest.approx(math.hypot(3.25, 4.25) - 1.0, abs=0.8)


def test_a_goal_that_recedes_along_a_corridor_gets_a_new_budget() -> None:
    def corridor(known_m: float) -> PlanningContext:
        known = int(known_m / 0.1)
        rows = ["#" * 160, *["#" + "." * known + " " * (159 - known)] * 14, "#" * 160]
        return context_of(search_view_of(drawn_map(*rows)), Pose2d(0.8, 0.8, 0.0))

    state = PlannerState(SEARCH)
    since_s = []
    for step in range(12):  # the end of what is known recedes by 0.5 m each second
        state = replace(state, active_time_s=float(step))
        state, *_ = explored(state, corridor(4.0 + 0.5 * step))
        goal = state.active_goal
        assert goal is not None
        since_s.append(goal.since_s)
    assert since_s[1] == 0.0
    assert len(set(since_s)) >= 3
    assert not state.ledger.attempts


def exhausted(state: PlannerState) -> PlannerState:
    """The state after all goals of the half-known room were given up."""
    for _ in range(99):
        state, *_ = explored(state, HALF_KNOWN)
        if state.active_goal is None:
            return state
        state = without(state, state.active_goal.goal)
    raise AssertionError("there was always another goal")


def test_before_an_object_counts_as_not_found_what_was_tried_is_offered_once_more() -> None:
    state, event = given_up(exhausted(PlannerState(SEARCH)), HALF_KNOWN)
    assert event is None
    assert explored(state, HALF_KNOWN)[0].active_goal is not None
    _, event = given_up(exhausted(state), HALF_KNOWN)
    assert isinstance(event, Ending)


def test_what_no_way_leads_to_is_named() -> None:
    rows = ["#####", "#...#", "#...#", "#####", *["#...#"] * 3, "#####"]
    apart = context_of(search_view_of(drawn_map(*rows, scale=5)))
    assert apart.unreachable_m2() > 1.0
    state = replace(planner_state(candidate(3.0, 1.2)), reconsidered=True)
    _, event = given_up(state, apart)
    assert isinstance(event, Ending)
    assert "m² of floor seen but not reachable" in event.reason
    assert event.reason.endswith("seen in 3 images at (3.0, 1.2), but no way to it was found")


def test_the_time_of_a_goal_does_not_run_while_a_candidate_is_approached() -> None:
    state, *_ = explored(PlannerState(SEARCH), HALF_KNOWN)
    assert state.active_goal is not None
    goal, there = state.active_goal.goal, candidate(2.0, 2.0)
    for after_s, event in ((1.0, CandidateSelected(there)), (99.0, Rejected())):
        state.active_time_s = after_s
        state.apply(event, EventStamp(after_s, after_s, (1.0, 1.0), 0.0))
    state, *_ = explored(state, HALF_KNOWN)
    assert state.active_goal is not None
    assert state.active_goal.goal == goal
    assert not state.ledger.attempts


def two_halves() -> PlanningContext:
    """Two rooms, in whose door the camera misses 0.14 m² of floor."""
    wall = "#" + "." * 28 + "##" + "." * 28 + "#"
    door = "#" + "." * 28 + "  " + "." * 28 + "#"
    view = drawn_map("#" * 60, *[wall] * 5, *[door] * 7, *[wall] * 4, "#" * 60)
    return context_of(search_view_of(view), Pose2d(0.9, 0.9, 0.0))


def crossed(state: PlannerState, here: PlanningContext) -> PlanningContext:
    """The context with what the state has looked into in vain."""
    (x, y), view = here.pose.xy, search_view_of(here.map_view)
    looked_xy, closed_xy = state.ledger.looked_xy, state.ledger.closed_xy
    looked = BesideMap(looked_into_xy=looked_xy, closed_xy=closed_xy)
    return build_context(Pose2d(x, y, 0.0), view, PARAMS.costmap, looked)


@pytest.mark.parametrize("there", [(), (candidate(0.9, 5.0),)], ids=["floor", "an object"])
def test_a_gap_too_narrow_for_a_frontier_is_looked_into_then_crossed(
    there: tuple[ObjectCandidate, ...],
) -> None:
    halves = two_halves()
    assert halves.unreachable_m2() > 1.0
    state = planner_state(*there)
    state, motion, event, candidates = explored(state, crossed(state, halves))
    assert candidates.frontiers == ()
    assert event is None
    assert isinstance(motion, Drive)
    goal = state.active_goal
    assert goal is not None
    assert goal.goal.look_xy[1] > 2.8
    state = without(state, goal.goal)  # it cannot be seen
    across = crossed(state, halves)
    assert across.unreachable_m2() < 0.1
    assert select_candidate(state, across) == (CandidateSelected(there[0]) if there else None)


def test_the_optimistic_way_leads_around_what_may_have_gone() -> None:
    """Where there is no other way, through it."""
    for door, opened in (("g", True), ("#", False)):
        here = two_rooms(door)
        reached = np.isfinite(here.optimistic.cost_to_go.cost_m[here.costmap.navigable])
        assert reached.all() == opened
        assert not np.isfinite(here.cost_to_go.cost_m[here.costmap.navigable]).all()


def two_rooms(door: str, far: str = ".") -> PlanningContext:
    """Two rooms of 4 x 4 m, the robot in the first; the door of 1 m shows this character."""
    wall = "#" * 9
    rows = [
        wall,
        *["#" + "." * 7 + "#"] * 7,
        "#" + "##" + door * 2 + "#" * 4,
        *["#" + far * 7 + "#"] * 7,
        wall,
    ]
    return context_of(search_view_of(drawn_map(*rows, scale=5)), Pose2d(1.5, 2.0, 0.0))


def test_a_search_looks_there_before_it_gives_up() -> None:
    here = two_rooms("g")
    state, looks = PlannerState(SEARCH), []
    for step in range(200):
        state, _, event, _ = explored(state, crossed(state, here))
        if isinstance(event, Ending):
            break
        if (active := state.active_goal) is not None:
            assert active.goal.doing == OBSTACLE
            looks.append(active.goal.viewpoint_xy)
            state = without(state, active.goal)  # seen, and still closed
        state = replace(state, active_time_s=float(step))
    assert isinstance(event, Ending)
    assert len(looks) == 2 * MAX_VISITS  # and once more before it gives up
