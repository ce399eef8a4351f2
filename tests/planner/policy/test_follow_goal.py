"""Between comparisons of goals the robot follows its goal on a part of the map, as on all of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.motion.motions import Drive, Pose2d, Rest
from onemap_planner.policy import choose as module
from onemap_planner.policy.choose import can_follow, follow_window
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.policy.move import follow_goal
from onemap_planner.policy.outcome import Observation
from onemap_planner.policy.state import ActiveGoal
from onemap_planner.search.state_machine import Exploring
from onemap_planner.world.costmap import BesideMap
from onemap_shared.geometry import F64, Velocity2d
from tests.planner.grid_world import SimulatedSearch, in_two_rooms, start
from tests.planner.one_room import candidate


@pytest.fixture(autouse=True)
def rare_comparisons(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if the rooms were a hall: goals are compared every few seconds."""
    monkeypatch.setattr(module, "EVERY_STEP_M2", 0.0)
    monkeypatch.setattr(module, "COMPARE_S_PER_M2", 0.1)


def observed(run: SimulatedSearch) -> Observation:
    """What the robot of the run would observe now, without detections."""
    view = run.world.view(run.state.search.target)
    return Observation(run.now_s, run.world.pose, 0.0, Velocity2d(), False, view, (), "")


def planned(run: SimulatedSearch, window_xy: F64 | None) -> PlanningContext:
    view = run.world.view(run.state.search.target)
    beside = BesideMap(np.array(run.state.trail), run.state.obstacles_xy)
    return build_context(run.world.pose, view, run.config.costmap, beside, window_xy=window_xy)


def following(run: SimulatedSearch, limit_s: float = 60.0) -> F64:
    """Step until goals need not be compared; the window of that step."""
    while run.now_s < limit_s:
        run.step()
        window_xy = follow_window(run.state, observed(run))
        if window_xy is not None:
            return window_xy
    raise AssertionError("goals were compared in every step")


def length_m(motion: Drive) -> float:
    return float(np.hypot(*np.diff(motion.points_xy, axis=0).T).sum())


def test_the_way_is_that_of_the_whole_map() -> None:
    run = start(in_two_rooms(), "unicorn")
    compared = 0
    while compared < 10:
        part, whole = planned(run, following(run)), planned(run, None)
        assert can_follow(run.state, part)
        assert part.map_view.grid.shape <= whole.map_view.grid.shape
        active_goal = run.state.active_goal
        assert active_goal is not None
        motion = follow_goal(run.state.copy(), part).motion
        expected = whole.drive_to(active_goal.goal.viewpoint_xy, active_goal.goal.look_xy)
        assert isinstance(motion, Drive)
        assert length_m(motion) == pytest.approx(length_m(expected), abs=1e-6)
        compared += 1


def test_goals_are_compared_when_the_period_the_budget_or_a_sighting_says_so() -> None:
    run = start(in_two_rooms(), "bed")
    following(run)
    state, active_goal = run.state, run.state.active_goal
    assert active_goal is not None
    assert isinstance(state.search.phase, Exploring)
    observation = observed(run)

    def window_with(changed: ActiveGoal | None) -> F64 | None:
        return follow_window(replace(state, active_goal=changed), observation)

    assert window_with(active_goal) is not None
    assert window_with(None) is None
    assert window_with(replace(active_goal, comparison=None)) is None
    assert window_with(replace(active_goal, arrived_s=0.0)) is None
    assert window_with(replace(active_goal, since_s=-1e3)) is None
    doubtful = replace(candidate(*run.world.pose.xy), supported=False)
    beside = replace(state.evidence, unsupported=(doubtful,))
    assert follow_window(replace(state, evidence=beside), observation) is None
    later = replace(state, active_time_s=state.active_time_s + 60.0)
    assert follow_window(later, observation) is None
    there = in_two_rooms()
    x, y = there.pose.xy
    there.pose = Pose2d(x, y + 4.0, np.pi / 2)
    detections = there.detect("bed", there.look())
    assert detections.names
    seen = replace(observation, detections=(detections,))
    assert follow_window(state, seen) is None


def test_without_a_way_in_the_window_the_whole_map_is_planned_on() -> None:
    run = start(in_two_rooms(), "unicorn")
    following(run)
    x, y = run.world.pose.xy
    nothing = planned(run, np.array([[x, y], [x, y]]))
    assert not can_follow(run.state, nothing)
    no_goal = replace(run.state, active_goal=None)
    assert not can_follow(no_goal, nothing)
    assert isinstance(follow_goal(no_goal, nothing).motion, Rest)
