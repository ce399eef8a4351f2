"""Only the arrival of something new is fresh; clocks of two boxes are never compared."""

import math
from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.inputs import Heard, hear_odometry, hear_revision
from onemap_planner.motion.pure_pursuit import STILL, Drive, Pose, Rest, Velocity
from onemap_planner.motion.staleness import Arrival, ages, complaint, newest
from onemap_planner.motion.velocity_controller import BRAKE_S, Helm, HelmSenses, Order, tick
from onemap_planner.policy.explore import Landmarks
from onemap_planner.policy.step import Decision
from onemap_shared.geometry import pose_2d
from onemap_shared.messages import MapRevision, Odometry
from tests.planner.drawn_maps import RULES, drawn, terrain_of

FRESH = RULES.freshness
SECOND = 1_000_000_000
OPEN = terrain_of(drawn(*["." * 10] * 10, scale=5), (1.0, 1.0), RULES.terrain)
AHEAD = Decision(Drive(np.array([[1.0, 1.0], [4.0, 1.0]]), (5.0, 1.0)), OPEN, None, Landmarks())
POSE = Pose(1.0, 1.0, 0.0)


def revision(number: int, stamp_ns: int) -> MapRevision:
    return MapRevision(number, number, stamp_ns, "mini", "mini", number, 1, 1, 1.0, 4.0)


def odometry(sequence: int, stamp_ns: int, x_m: float = 0.0, speed: float = 0.5) -> Odometry:
    return Odometry(sequence, stamp_ns, pose_2d(x_m, 0.0, 0.3), speed, 0.0)


def heard(offset_s: float = 0.0, lag_s: float = 0.1, at_s: float = 10.0) -> Heard:
    """Both streams at ``at_s``; the robot's clock is off by ``offset_s``."""
    now_ns = int((at_s + offset_s) * SECOND)
    start = hear_odometry(Heard(), odometry(1, now_ns), at_s)
    return hear_revision(start, revision(1, now_ns - int(lag_s * SECOND)), at_s)


def test_nothing_heard_is_infinitely_old() -> None:
    assert math.isinf(Heard().ages(5.0).odometry_s)
    assert Heard().complaint(5.0, FRESH) == "odometry has never arrived"


@pytest.mark.parametrize("offset_s", [0.0, 3600.0, -9.0])
def test_clocks_need_not_agree(offset_s: float) -> None:
    assert heard(offset_s).complaint(10.3, FRESH) == ""
    assert heard(offset_s, lag_s=1.4).complaint(10.0, FRESH) == (
        "the map shows the world of 1.4 s ago"
    )


def test_silence_is_told_with_its_length() -> None:
    late = hear_odometry(heard(), odometry(2, 0), 11.2)
    assert late.complaint(11.2, FRESH) == "the map is 1.2 s old"
    assert heard().complaint(10.8, FRESH) == "odometry is 0.8 s old"


def test_a_repeated_message_is_not_fresh() -> None:
    known = Arrival(7, 0, 1.0)
    assert newest(known, Arrival(7, 0, 9.0)) is known
    assert newest(known, Arrival(3, 0, 9.0)).at_s == 9.0  # the mapper began anew
    assert newest(None, known) is known


def test_stamps_that_cannot_be_compared_are_left_alone() -> None:
    wild = ages(Arrival(1, 5 * SECOND, 1.0), Arrival(1, 900 * SECOND, 1.0), 1.0)
    assert wild.map_lag_s == 0.0
    assert complaint(wild, FRESH) == ""


def test_the_odometer_counts_driving_only() -> None:
    state = hear_odometry(Heard(), odometry(1, 0, 0.0), 0.0)
    state = hear_odometry(state, odometry(2, 0, 0.3), 0.1)
    assert state.odometer_m == pytest.approx(0.3)
    carried = hear_odometry(state, odometry(3, 0, 8.0), 0.2)
    assert carried.odometer_m == pytest.approx(0.3)
    trembling = hear_odometry(state, odometry(3, 0, 0.31, speed=0.0), 0.2)
    assert trembling.odometer_m == pytest.approx(0.3)
    assert trembling.pose is not None
    assert trembling.pose.yaw_rad == pytest.approx(0.3)


def steered(helm: Helm, *, complaint: str = "", now_s: float = 1.0, search: str = "s") -> Helm:
    senses = HelmSenses(now_s, search, POSE, complaint)
    return tick(helm, Order("s", AHEAD, 1.0), senses, RULES)[0]


def test_the_helm_drives_on_fresh_senses_only() -> None:
    helm = Helm(at_s=0.95)
    moving = steered(helm)
    assert moving.command.linear_mps == pytest.approx(0.05)  # 1 m/s^2 for 0.05 s
    stopped = steered(moving, complaint="the map is 1.2 s old", now_s=1.05)
    assert stopped.command == STILL
    assert stopped.stops == 1
    assert steered(stopped, complaint="the map is 1.3 s old", now_s=1.1).stops == 1
    assert steered(stopped, now_s=1.1).command.linear_mps > 0  # it goes on


def test_an_old_order_and_one_for_another_search_are_not_followed() -> None:
    helm = Helm(command=Velocity(0.5, 0.0), at_s=2.0)
    assert steered(helm, now_s=1.0 + FRESH.max_plan_age_s + 0.1).command == STILL
    assert steered(helm, search="other").command == STILL
    senses = HelmSenses(1.0, "s", POSE, "")
    assert tick(helm, None, senses, RULES)[0].command == STILL
    assert tick(helm, Order("s", AHEAD, 1.0), replace(senses, pose=None), RULES)[0].command == STILL


def test_after_the_end_it_brakes_and_falls_silent() -> None:
    helm = steered(Helm(at_s=0.95))
    for now_s, sends in ((1.1, True), (1.0 + BRAKE_S, True), (1.2 + BRAKE_S, False)):
        after, sent = tick(helm, None, HelmSenses(now_s, "", POSE, ""), RULES)
        assert after.command == STILL
        assert sent is sends


def test_resting_is_commanded_too() -> None:
    order = Order("s", replace(AHEAD, motion=Rest()), 1.0)
    helm, sent = tick(Helm(at_s=0.95), order, HelmSenses(1.0, "s", POSE, ""), RULES)
    assert sent
    assert helm.command == STILL


def test_a_collision_is_remembered_until_the_next_plan() -> None:
    hit = replace(odometry(1, 0), collided=True)
    state = hear_odometry(hear_odometry(Heard(), hit, 3.0), odometry(2, 0), 3.1)
    assert state.collided_s == 3.0
