"""A robot that keeps getting stuck gives up the goal, then the search."""

from dataclasses import replace

from onemap_planner.policy.state import (
    Observation,
    PlannerState,
)
from onemap_planner.policy.step import step
from onemap_planner.search.phases import Approaching, Exploring, Finished
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import SearchState
from tests.planner.drawn_maps import PARAMS
from tests.planner.one_room import POSE, ROOM, SEARCH, candidate, planner_state


def stuck_state(phase: Approaching | Exploring, stuck_count: int) -> PlannerState:
    """The mind after this many collisions in one place, five seconds apart."""
    state = replace(planner_state(candidate(2.5, 2.5)), search=replace(SEARCH, phase=phase))
    for number in range(8 * stuck_count + 5):
        observation = Observation(
            now_s=0.7 * number,
            pose=POSE,
            odometer_m=0.0,
            command=Velocity2d(0.3, 0.0),
            collided=number % 8 == 7,
            view=ROOM,
            detections=(),
            stale_reason="",
        )
        state, _ = step(state, observation, PARAMS)
    return state


def test_bumps_give_up_the_candidate_and_a_robot_that_is_held_gives_up() -> None:
    target = candidate(2.5, 2.5)
    left = stuck_state(Approaching(target), PARAMS.recovery.max_stuck_count)
    assert left.target_state.rejected == (target,) or left.target_state.reconsidered
    end = stuck_state(Approaching(target), PARAMS.recovery.max_stuck_count + 2).search
    assert end.phase == Finished(SearchState.FAILED)
    assert end.reason == "the robot is stuck at (1.0, 1.0)"
