"""Goals of a drive to a place, the best first."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest

from onemap_planner.motion.motions import Pose2d
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.policy.goals import Goal, GoalKind
from onemap_planner.policy.ways import (
    MAX_UNREACHED,
    UnreachedPlace,
    nearest_reachable_m,
    place_goals,
    visit_counts,
    ways_to_unreached,
)
from onemap_planner.search.phases import Destination
from onemap_shared.messages import SearchKind
from tests.planner.drawn_maps import NO_POINTS, POINT_ROBOT, drawn_map, search_view_of

# Cells of 0.5 m: a room with a table in its middle, a door, and unknown space behind it.
ROOM = (
    "##########",
    "#........#",
    "#........#",
    "#...##...#",
    "#...##...#",
    "#........#",
    "#........#",
    "########.#",
    *["          "] * 5,
)


def context_of(*rows: str, robot_xy: tuple[float, float] = (1.0, 1.0)) -> PlanningContext:
    view = search_view_of(drawn_map(*rows, scale=5))
    return build_context(
        Pose2d(*robot_xy, 0.0), view, trail=(), obstacles_xy=NO_POINTS, params=POINT_ROBOT
    )


CONTEXT = context_of(*ROOM)


def goals(
    x: float, y: float, kind: SearchKind = SearchKind.GO_TO, visited: np.ndarray = NO_POINTS
) -> list[Goal]:
    visits = visit_counts(CONTEXT, visited)
    return list(place_goals(Destination(kind, (x, y)), CONTEXT, visits))


def away_m(goal: Goal, x: float, y: float) -> float:
    return hypot(goal.viewpoint_xy[0] - x, goal.viewpoint_xy[1] - y)


def test_a_known_place_is_the_only_goal() -> None:
    (goal,) = goals(3.0, 1.0)
    assert goal.kind is GoalKind.GO_TO
    assert away_m(goal, 3.0, 1.0) < 0.1
    assert goal.reason.startswith("the place (3.00, 1.00), 1.9 m away")


def test_the_edge_of_a_table_is_reached_beside_it() -> None:
    (goal,) = goals(1.75, 2.05)
    assert 0.05 < away_m(goal, 1.75, 2.05) <= 0.5


def test_the_middle_of_a_table_has_no_goal() -> None:
    assert goals(2.0, 2.5) == []
    assert 0.4 < nearest_reachable_m((2.0, 2.5), CONTEXT) < 0.8


def test_an_unknown_place_is_explored_through_the_door() -> None:
    (goal,) = goals(5.0, 1.0)
    assert goal.kind is GoalKind.FRONTIER
    assert goal.viewpoint_xy == pytest.approx((3.95, 4.25), abs=0.3)
    assert "on the way to the place (5.00, 1.00): unknown space 4." in goal.reason


def test_after_a_visit_the_robot_looks_from_farther_away() -> None:
    (first,) = goals(5.0, 4.25)
    (second,) = goals(5.0, 4.25, visited=np.array([first.look_xy]))
    distance = hypot(
        second.viewpoint_xy[0] - second.look_xy[0], second.viewpoint_xy[1] - second.look_xy[1]
    )
    assert distance >= POINT_ROBOT.escape_radius_m
    assert goals(5.0, 4.25, visited=np.array([first.look_xy] * 2)) == []


def test_a_view_of_a_table_is_from_the_nearest_side() -> None:
    (goal,) = goals(1.75, 2.25, SearchKind.LOOK_AT)
    assert goal.kind is GoalKind.LOOK_AT
    assert 0.8 <= away_m(goal, 1.75, 2.25) <= 3.0
    assert goal.look_xy == (1.75, 2.25)
    assert goal.reason.startswith("a view of the place (1.75, 2.25), ")


def test_what_a_table_hides_is_looked_at_from_the_side() -> None:
    (goal,) = goals(3.25, 3.5, SearchKind.LOOK_AT)
    x, y = goal.viewpoint_xy
    ahead = np.linspace([x, y], [3.25, 3.5], 100)
    cells = CONTEXT.costmap.grid.cells(ahead)
    assert not CONTEXT.costmap.occupied[cells[:, 0], cells[:, 1]].any()


def test_a_view_into_the_unknown_is_the_last_resort() -> None:
    first, last = goals(4.1, 4.25, SearchKind.LOOK_AT)
    assert (first.kind, last.kind) == (GoalKind.FRONTIER, GoalKind.LOOK_AT)
    assert away_m(last, 4.1, 4.25) < 1.6


@pytest.mark.parametrize("kind", [SearchKind.GO_TO, SearchKind.LOOK_AT])
def test_far_outside_only_the_way_there_is_a_goal(kind: SearchKind) -> None:
    (goal,) = goals(500.0, -300.0, kind)
    assert goal.kind is GoalKind.FRONTIER
    assert nearest_reachable_m((500.0, -300.0), CONTEXT) > 500.0


def test_a_place_behind_a_wall_does_not_count_as_reached_from_this_side() -> None:
    rows = ("######", "#....#", "######", "#....#", "######")
    view = search_view_of(drawn_map(*rows, scale=2))
    context = build_context(
        Pose2d(0.3, 0.5, 0.0), view, trail=(), obstacles_xy=NO_POINTS, params=POINT_ROBOT
    )
    visits = visit_counts(context, NO_POINTS)
    there = Destination(SearchKind.GO_TO, (0.65, 0.5))
    assert list(place_goals(there, context, visits)) == []


def test_without_reachable_floor_the_nearest_is_infinitely_far() -> None:
    context = context_of("###", "###", "###", robot_xy=(0.75, 0.75))
    assert nearest_reachable_m((0.1, 0.1), context) == np.inf


def ways(*places: UnreachedPlace) -> list[Goal]:
    visits = visit_counts(CONTEXT, NO_POINTS)
    return ways_to_unreached(places, CONTEXT, visits)


def test_ways_are_planned_to_the_most_similar_places_only() -> None:
    goals = ways(*[UnreachedPlace((5.25, 1.25 + i), 0.1 * i) for i in range(4)])
    assert [goal.utility.score for goal in goals] == pytest.approx([0.3, 0.2])
    assert len(goals) == MAX_UNREACHED
    assert all(goal.kind is GoalKind.FRONTIER for goal in goals)


def test_the_way_to_an_unreached_place_counts_to_its_end() -> None:
    near, far = (ways(UnreachedPlace((5.25, y), 0.8))[0] for y in (4.25, 1.25))
    assert near.look_xy == pytest.approx(far.look_xy, abs=1.0)  # through the same door
    assert far.utility.travel_m > near.utility.travel_m + 1.0
    assert far.utility.total < near.utility.total


def test_no_way_leads_to_what_is_known_all_around() -> None:
    assert ways(UnreachedPlace((2.0, 2.25), 0.9)) == []
