"""A choice names the goals that were weighed and why one won; who creeps says why."""

from dataclasses import replace

import pytest

from onemap_planner.motion.motions import STOP, Pose2d
from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.outcome import Observation
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.step import step
from onemap_planner.policy.tell import explain
from onemap_planner.search.state_machine import EventStamp, Exploring, reason_of, status
from onemap_planner.sentences import ALIKE, UNEXPLORED, Landmarks
from onemap_shared.messages import CameraView
from tests.planner.drawn_maps import PARAMS, drawn_map, search_view_of
from tests.planner.one_room import SEARCH, context_of, explored, without

TWO_OPENINGS = context_of(
    search_view_of(drawn_map(*["......    "] * 4, *["####......"], *["......    "] * 5, scale=5)),
    Pose2d(1.0, 2.5, 0.0),
)


def goal(
    x: float,
    score: float = 0.3,
    travel_m: float = 1.0,
    kind: GoalKind = GoalKind.FRONTIER,
) -> Goal:
    utility = GoalUtility(score, travel_m)
    return Goal(kind, (x, 1.0), (x, 0.0), utility, UNEXPLORED)


def said(best: Goal, *options: Goal) -> str:
    """The sentence of a choice for a robot at the origin that looks along x."""
    return explain(best, options, Landmarks((0.0, 0.0), 0.0), "kettle").sentence


def test_the_winner_is_compared_with_the_others_by_what_made_the_difference() -> None:
    best, near = goal(5.0, score=0.8, travel_m=5.0), goal(2.0, score=0.3, travel_m=1.0)
    choice = explain(best, [near, best], Landmarks((0.0, 0.0), 0.0), "kettle")
    assert [(option.xy_m, option.chosen) for option in choice.options] == [
        ((5.0, 1.0), True),
        ((2.0, 1.0), False),
    ]
    assert choice.sentence == "going to the unexplored space 5 m ahead: it promises most"
    closer = goal(3.0, travel_m=0.5)
    assert said(closer, closer, near).endswith("ahead: it is the nearest")
    farther, beaten = goal(3.0, score=0.4, travel_m=0.6), goal(4.0, score=0.9, travel_m=60.0)
    assert said(farther, farther, near, beaten).endswith(
        "it is the nearest and promises more than the next best place"
    )
    twin = replace(near, look_xy=(9.0, 9.0), viewpoint_xy=(9.0, 9.0))
    assert said(near, near, twin).endswith("ahead: no other place is better")
    assert said(near, near).endswith("ahead: it is the only place left to look at")
    region = replace(goal(3.0, travel_m=0.5, kind=GoalKind.REGION), doing=ALIKE)
    assert said(region, region, near) == (
        "going to the place 3 m ahead: it looks like a kettle and is the nearest"
    )


def test_a_goal_that_is_kept_by_hysteresis_says_so() -> None:
    kept, better = goal(1.0, score=0.50), goal(-2.0, score=0.55, kind=GoalKind.REGION)
    assert said(kept, kept, better) == (
        "going to the unexplored space 1 m ahead: the robot is on its way there, and no other "
        "place is much better"
    )


def test_a_choice_is_explained_once_and_counted() -> None:
    state, *_ = explored(PlannerState(SEARCH), TWO_OPENINGS)
    first = state.search.choice
    active = state.active_goal
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


@pytest.mark.parametrize(
    ("beside", "why"),
    [
        pytest.param(" ", "it sees the floor only from 1.2 m on", id="unseen floor"),
        pytest.param("#", "driving slowly, because obstacles are near", id="an obstacle"),
    ],
)
def test_a_robot_that_creeps_says_why_and_what_helps(beside: str, why: str) -> None:
    view = search_view_of(drawn_map(*["..." + beside * 3] * 6, scale=5))
    state = PlannerState(replace(SEARCH, phase=Exploring()))
    said = []
    for step_s in range(4):
        observation = Observation(
            now_s=0.5 * step_s,
            pose=Pose2d(1.5, 1.25, 0.0),
            odometer_m=0.0,
            command=STOP,
            collided=False,
            view=view,
            detections=(),
            stale_reason="",
            creeps=step_s < 3,
            camera=CameraView(height_m=0.9, down_deg=36.0, up_deg=20.0),
        )
        state = step(state, observation, PARAMS).state
        reason = status(state.search, EventStamp(0.0, 0.0, None, 0.0), now_ns=0).reason
        said.append(reason.removeprefix(reason_of(state.search)))
    assert said[0] == said[1] == said[3] == ""
    assert why in said[2]
