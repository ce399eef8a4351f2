"""Only the arrival of something new is fresh; clocks of two boxes are never compared."""

import math
from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.inputs import LatestInputs, with_odometry, with_revision
from onemap_planner.motion.motions import STOP, Drive, Pose2d, Rest
from onemap_planner.motion.staleness import Arrival, ages, newest, stale_reason
from onemap_planner.motion.velocity_controller import (
    BRAKE_S,
    ControllerInputs,
    Plan,
    VelocityController,
    update_command,
)
from onemap_planner.policy.explore import GoalCandidates
from onemap_planner.policy.step import Decision
from onemap_shared.geometry import Velocity2d, pose_2d
from onemap_shared.messages import MapRevision, Odometry
from tests.planner.drawn_maps import PARAMS, costmap_of, drawn_map

FRESH = PARAMS.staleness
SECOND = 1_000_000_000
OPEN = costmap_of(drawn_map(*["." * 10] * 10, scale=5), (1.0, 1.0), PARAMS.costmap)
AHEAD = Decision(
    Drive(np.array([[1.0, 1.0], [4.0, 1.0]]), (5.0, 1.0)), OPEN, None, GoalCandidates()
)
POSE = Pose2d(1.0, 1.0, 0.0)


def revision(number: int, stamp_ns: int) -> MapRevision:
    return MapRevision(number, number, stamp_ns, "mini", "mini", number, 1, 1, 1.0, 4.0)


def odometry(sequence: int, stamp_ns: int, x_m: float = 0.0, speed: float = 0.5) -> Odometry:
    return Odometry(sequence, stamp_ns, pose_2d(x_m, 0.0, 0.3), speed, 0.0)


def inputs(offset_s: float = 0.0, lag_s: float = 0.1, at_s: float = 10.0) -> LatestInputs:
    """Both streams at ``at_s``; the robot's clock is off by ``offset_s``."""
    now_ns = int((at_s + offset_s) * SECOND)
    start = with_odometry(LatestInputs(), odometry(1, now_ns), at_s)
    return with_revision(start, revision(1, now_ns - int(lag_s * SECOND)), at_s)


def test_nothing_heard_is_infinitely_old() -> None:
    assert math.isinf(LatestInputs().ages(5.0).odometry_s)
    assert LatestInputs().stale_reason(5.0, FRESH) == "odometry has never arrived"


@pytest.mark.parametrize("offset_s", [0.0, 3600.0, -9.0])
def test_clocks_need_not_agree(offset_s: float) -> None:
    assert inputs(offset_s).stale_reason(10.3, FRESH) == ""
    assert inputs(offset_s, lag_s=1.4).stale_reason(10.0, FRESH) == (
        "the map shows the world of 1.4 s ago"
    )


def test_silence_is_told_with_its_length() -> None:
    late = with_odometry(inputs(), odometry(2, 0), 11.2)
    assert late.stale_reason(11.2, FRESH) == "the map is 1.2 s old"
    assert inputs().stale_reason(10.8, FRESH) == "odometry is 0.8 s old"


def test_a_repeated_message_is_not_fresh() -> None:
    known = Arrival(7, 0, 1.0)
    assert newest(known, Arrival(7, 0, 9.0)) is known
    assert newest(known, Arrival(3, 0, 9.0)).at_s == 9.0  # the mapper began anew
    assert newest(None, known) is known


def test_stamps_that_cannot_be_compared_are_left_alone() -> None:
    wild = ages(Arrival(1, 5 * SECOND, 1.0), Arrival(1, 900 * SECOND, 1.0), 1.0)
    assert wild.map_lag_s == 0.0
    assert stale_reason(wild, FRESH) == ""


def test_the_odometer_counts_driving_only() -> None:
    state = with_odometry(LatestInputs(), odometry(1, 0, 0.0), 0.0)
    state = with_odometry(state, odometry(2, 0, 0.3), 0.1)
    assert state.odometer_m == pytest.approx(0.3)
    carried = with_odometry(state, odometry(3, 0, 8.0), 0.2)
    assert carried.odometer_m == pytest.approx(0.3)
    trembling = with_odometry(state, odometry(3, 0, 0.31, speed=0.0), 0.2)
    assert trembling.odometer_m == pytest.approx(0.3)
    assert trembling.pose is not None
    assert trembling.pose.yaw_rad == pytest.approx(0.3)


def controlled(
    controller: VelocityController, *, stale_reason: str = "", now_s: float = 1.0, search: str = "s"
) -> VelocityController:
    observation = ControllerInputs(now_s, search, POSE, stale_reason)
    return update_command(controller, Plan("s", AHEAD, 1.0), observation, PARAMS)[0]


def test_the_helm_drives_on_fresh_senses_only() -> None:
    controller = VelocityController(at_s=0.95)
    moving = controlled(controller)
    assert moving.command.linear_mps == pytest.approx(0.05)  # 1 m/s^2 for 0.05 s
    stopped = controlled(moving, stale_reason="the map is 1.2 s old", now_s=1.05)
    assert stopped.command == STOP
    assert stopped.stops == 1
    assert controlled(stopped, stale_reason="the map is 1.3 s old", now_s=1.1).stops == 1
    assert controlled(stopped, now_s=1.1).command.linear_mps > 0  # it goes on


def test_an_old_order_and_one_for_another_search_are_not_followed() -> None:
    controller = VelocityController(command=Velocity2d(0.5, 0.0), at_s=2.0)
    assert controlled(controller, now_s=1.0 + FRESH.max_plan_age_s + 0.1).command == STOP
    assert controlled(controller, search="other").command == STOP
    observation = ControllerInputs(1.0, "s", POSE, "")
    assert update_command(controller, None, observation, PARAMS)[0].command == STOP
    assert (
        update_command(controller, Plan("s", AHEAD, 1.0), replace(observation, pose=None), PARAMS)[
            0
        ].command
        == STOP
    )


def test_after_the_end_it_brakes_and_falls_silent() -> None:
    controller = controlled(VelocityController(at_s=0.95))
    for now_s, sends in ((1.1, True), (1.0 + BRAKE_S, True), (1.2 + BRAKE_S, False)):
        after, sent = update_command(
            controller, None, ControllerInputs(now_s, "", POSE, ""), PARAMS
        )
        assert after.command == STOP
        assert sent is sends


def test_resting_is_commanded_too() -> None:
    plan = Plan("s", replace(AHEAD, motion=Rest()), 1.0)
    controller, sent = update_command(
        VelocityController(at_s=0.95), plan, ControllerInputs(1.0, "s", POSE, ""), PARAMS
    )
    assert sent
    assert controller.command == STOP


def test_a_collision_is_remembered_until_the_next_plan() -> None:
    hit = replace(odometry(1, 0), collided=True)
    state = with_odometry(with_odometry(LatestInputs(), hit, 3.0), odometry(2, 0), 3.1)
    assert state.collided_s == 3.0
