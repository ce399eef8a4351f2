"""The velocity controller tracks fresh plans on fresh inputs, and stops otherwise."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_planner.motion.collision_monitor import SLACK_M, MonitorAction
from onemap_planner.motion.motions import STOP, Drive, Motion, Pose2d, Rest, Reverse, Rotate, moved
from onemap_planner.motion.velocity_controller import (
    BRAKE_S,
    ControllerInputs,
    Plan,
    VelocityController,
)
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import VelocityCommand
from tests.planner.drawn_maps import PARAMS, costmap_of, drawn_map

MAX_PLAN_AGE_S = PARAMS.staleness.max_plan_age_s
OPEN = costmap_of(drawn_map(*["." * 10] * 10, scale=5), (1.0, 1.0), PARAMS.costmap)
AHEAD = Plan("s", Drive(np.array([[1.0, 1.0], [4.0, 1.0]]), (5.0, 1.0)), OPEN, 1.0)
POSE = Pose2d(1.0, 1.0, 0.0)


def updated(
    controller: VelocityController, plan: Plan | None, inputs: ControllerInputs
) -> tuple[VelocityController, bool]:
    return controller.update(plan, inputs, PARAMS.drive, max_plan_age_s=MAX_PLAN_AGE_S)


def controlled(
    controller: VelocityController, *, stale_reason: str = "", now_s: float = 1.0, search: str = "s"
) -> VelocityController:
    inputs = ControllerInputs(now_s, search, POSE, stale_reason)
    return updated(controller, AHEAD, inputs)[0]


def test_it_moves_on_fresh_inputs_only() -> None:
    controller = VelocityController(at_s=0.95)
    moving = controlled(controller)
    assert moving.command.linear_mps == pytest.approx(0.05)  # 1 m/s^2 for 0.05 s
    stopped = controlled(moving, stale_reason="the map is 1.2 s old", now_s=1.05)
    assert stopped.command == STOP
    assert stopped.stops == 1
    assert controlled(stopped, stale_reason="the map is 1.3 s old", now_s=1.1).stops == 1
    assert controlled(stopped, now_s=1.1).command.linear_mps > 0  # it goes on


@given(
    motion=st.sampled_from([AHEAD.motion, Rotate(), Reverse(), Rest()]),
    before=st.builds(Velocity2d, st.floats(-0.7, 0.7), st.floats(-1.5, 1.5)),
    inputs=st.builds(
        ControllerInputs,
        now_s=st.floats(AHEAD.made_s, AHEAD.made_s + 2 * MAX_PLAN_AGE_S),
        search_id=st.sampled_from(["s", "other", ""]),
        pose=st.sampled_from([POSE, None]),
        stale_reason=st.sampled_from(["", "odometry is 0.6 s old"]),
    ),
)
def test_it_stops_at_once_unless_everything_is_fresh(
    motion: Motion, before: Velocity2d, inputs: ControllerInputs
) -> None:
    controller = VelocityController(before, before, at_s=inputs.now_s - 0.05, active_s=inputs.now_s)
    after, sent = updated(controller, replace(AHEAD, motion=motion), inputs)
    fresh = (
        inputs.search_id == AHEAD.search_id
        and inputs.pose is not None
        and not inputs.stale_reason
        and inputs.now_s - AHEAD.made_s <= MAX_PLAN_AGE_S
    )
    assert sent
    if not fresh:
        assert after.command == STOP
    elif before == STOP:
        assert (after.command == STOP) == (motion == Rest())


def test_after_the_end_it_brakes_and_then_sends_nothing() -> None:
    controller = controlled(VelocityController(at_s=0.95))
    for now_s, sends in ((1.1, True), (1.0 + BRAKE_S, True), (1.2 + BRAKE_S, False)):
        after, sent = updated(controller, None, ControllerInputs(now_s, "", POSE, ""))
        assert after.command == STOP
        assert sent is sends


def test_braking_outlasts_the_robot_s_deadman_timer() -> None:
    assert VelocityCommand(0, 0, 0.0, 0.0).validity_ms / 1e3 < BRAKE_S


def test_a_plan_that_drives_at_a_wall_is_slowed_down_and_stopped_once() -> None:
    rows = ["." * 6] * 6 + ["######"] * 2
    costmap = costmap_of(drawn_map(*rows, scale=5), (0.5, 1.5), PARAMS.costmap)
    wrong = Drive(np.array([[0.5, 1.5], [9.0, 1.5]]), (9.0, 1.5))  # the wall begins at x = 3 m
    controller, pose = VelocityController(at_s=0.95), Pose2d(0.5, 1.5, 0.0)
    fastest_mps = 0.0
    for k in range(300):
        plan = replace(AHEAD, motion=wrong, costmap=costmap, made_s=1.0 + k / 20)
        controller, _ = updated(controller, plan, ControllerInputs(1.0 + k / 20, "s", pose, ""))
        fastest_mps = max(fastest_mps, controller.command.linear_mps)
        pose = moved(pose, controller.command, 0.05)
    assert fastest_mps > 0.5
    assert 2.7 < pose.x_m <= 3.0 - PARAMS.costmap.radius_m + SLACK_M + 1e-3
    assert controller.command.linear_mps < 0.01
    assert controller.monitor.slowdowns >= 1
    assert controller.monitor.stops >= 1
    counts = controller.monitor
    for _ in range(5):
        counts = counts.counting(MonitorAction.STOPPED)
    assert counts.stops - controller.monitor.stops <= 1  # one stop, however long it lasts


def test_on_an_old_map_it_drives_so_slowly_that_it_stops_in_time() -> None:
    moving = Velocity2d(0.7, 0.0)
    speeds_mps = []
    for map_age_s in (0.0, 0.5, 1.0, 1.5, 3.0):
        controller = VelocityController(moving, moving, at_s=0.95)
        for k in range(10):
            inputs = ControllerInputs(1.0 + 0.05 * k, "s", POSE, "", map_age_s=map_age_s)
            controller, _ = updated(controller, AHEAD, inputs)
        speed_mps = controller.command.linear_mps
        speeds_mps.append(speed_mps)
        stop_m = speed_mps * map_age_s + speed_mps**2 / (2 * PARAMS.drive.max_linear_mps2)
        assert stop_m <= PARAMS.drive.unseen_stop_m + 1e-6
    assert speeds_mps == sorted(speeds_mps, reverse=True)
    assert speeds_mps[1] == PARAMS.drive.max_linear_mps  # two frames per second cost nothing
    assert 0.2 < speeds_mps[-1] < 0.3


@pytest.mark.parametrize(("floor", "creeps"), [("a", True), (".", False)])
def test_it_tells_when_it_creeps_over_floor_that_no_camera_saw(floor: str, creeps: bool) -> None:
    rows = ["." * 50] * 12 + [floor * 50] * 38
    away = np.array([[4.5, 4.5]])  # where the search began
    costmap = costmap_of(drawn_map(*rows), (1.0, 1.0), PARAMS.costmap, trail_xy=away)
    controller = VelocityController(at_s=0.95)
    for tick in range(20):
        now_s = 1.0 + 0.05 * tick
        inputs = ControllerInputs(now_s, "s", POSE, "")
        controller, _ = updated(controller, replace(AHEAD, costmap=costmap, made_s=now_s), inputs)
    assert controller.creeps(PARAMS.drive) == creeps


def test_creeping_along_a_bend_it_does_not_turn_to_and_fro() -> None:
    """The arc to a near point and the one to a far point may turn to different sides."""
    rows, away = ["a" * 10] * 10, np.array([[0.5, 0.5]])
    costmap = costmap_of(drawn_map(*rows, scale=5), (2.5, 2.5), PARAMS.costmap, trail_xy=away)
    bend = Drive(np.array([[2.5, 2.5], [2.52, 2.6], [2.12, 2.6], [1.92, 2.4]]), (1.5, 2.0))
    controller, pose = VelocityController(at_s=0.95), Pose2d(2.5, 2.5, 1.75)
    for tick in range(600):
        now_s = 1.0 + 0.05 * tick
        plan = Plan("s", bend, costmap, now_s)
        controller, _ = updated(controller, plan, ControllerInputs(now_s, "s", pose, ""))
        pose = moved(pose, controller.command, 0.05)
    assert pose.distance_to((1.92, 2.4)) < 0.3
