"""A choice names the best goals that were weighed, and why one of them won."""

from dataclasses import replace

from onemap_planner.motion.motions import Pose2d
from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility, explain
from onemap_planner.policy.memory import PlannerState
from tests.planner.drawn_maps import drawn_map, search_view_of
from tests.planner.one_room import SEARCH, context_of, explored, without

TWO_OPENINGS = context_of(
    search_view_of(drawn_map(*["......    "] * 4, *["####......"], *["......    "] * 5, scale=5)),
    Pose2d(1.0, 2.5, 0.0),
)


def goal(
    x: float,
    score: float = 0.3,
    travel_m: float = 1.0,
    length_m: float = 0.0,
    kind: GoalKind = GoalKind.FRONTIER,
) -> Goal:
    utility = GoalUtility.of(score, travel_m, length_m=length_m)
    return Goal(kind, (x, 1.0), (x, 0.0), utility, "a goal")


def test_the_winner_is_compared_with_the_next_by_what_made_the_difference() -> None:
    best, near = goal(1.0, score=0.8, travel_m=5.0), goal(2.0, score=0.3, travel_m=1.0)
    choice = explain(best, [near, best])
    assert [(option.xy_m, option.chosen) for option in choice.options] == [
        ((1.0, 1.0), True),
        ((2.0, 1.0), False),
    ]
    assert choice.sentence == (
        "utility 0.36, 0.12 more than the frontier at (2.0, 1.0): "
        "it is more similar (0.80 against 0.30)"
    )
    closer = explain(goal(3.0, travel_m=0.5), [goal(3.0, travel_m=0.5), near])
    assert closer.sentence.endswith("its way is shorter (0.5 m against 1.0 m)")
    wider = explain(goal(3.0, length_m=2.0), [goal(3.0, length_m=2.0), near])
    assert wider.sentence.endswith("it opens a wider view")
    twins = explain(near, [near, replace(near, viewpoint_xy=(9.0, 9.0))])
    assert twins.sentence == "utility 0.24, 0.00 more than the frontier at (9.0, 9.0)"
    here = replace(best, look_xy=(9.0, 9.0), kind=GoalKind.REGION)
    at_one_place = explain(near, [near, best, here])
    assert [option.xy_m for option in at_one_place.options] == [(1.0, 1.0), (2.0, 1.0)]
    assert at_one_place.left_out == 0


def test_a_goal_that_is_kept_by_hysteresis_says_so() -> None:
    kept, better = goal(1.0, score=0.50), goal(2.0, score=0.55, kind=GoalKind.REGION)
    choice = explain(kept, [kept, better])
    assert [option.chosen for option in choice.options] == [False, True]
    assert choice.sentence == (
        "kept although the region at (2.0, 1.0) has 0.04 more utility: the robot turns away from "
        "its goal only for 30 % more"
    )


def test_a_choice_is_explained_once_and_counted() -> None:
    state, *_ = explored(PlannerState(SEARCH), TWO_OPENINGS)
    first = state.search.choice
    active = state.memory.active_goal
    assert active is not None
    assert first.number == 1
    (chosen,) = [option for option in first.options if option.chosen]
    assert chosen.xy_m == active.goal.viewpoint_xy
    assert len(first.options) + first.left_out >= 2
    state, *_ = explored(replace(state, active_time_s=1.0), TWO_OPENINGS)
    assert state.search.choice is first
    state = without(replace(state, active_time_s=2.0), active.goal)
    state, *_ = explored(state, TWO_OPENINGS)
    assert state.search.choice.number == 2
    assert state.search.choice.options != first.options
