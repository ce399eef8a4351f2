"""The latest inputs: pose, odometer, collisions and ages, from the messages that arrive."""

import math
from dataclasses import replace

import pytest

from onemap_planner.inputs import (
    LatestInputs,
    with_members,
    with_odometry,
    with_revision,
    with_sent,
    with_start,
)
from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.staleness import LoopMonitor, SentCommand
from onemap_shared.geometry import pose_2d
from onemap_shared.messages import Heartbeat, MapRevision, Odometry
from tests.planner.drawn_maps import PARAMS

FRESH = PARAMS.staleness
SECOND = 1_000_000_000


def revision(number: int, stamp_ns: int) -> MapRevision:
    return MapRevision(number, number, stamp_ns, "mini", "mini", number, 1, 1, 1.0, 4.0)


def odometry(sequence: int, stamp_ns: int, x_m: float = 0.0, speed: float = 0.5) -> Odometry:
    return Odometry(sequence, stamp_ns, pose_2d(x_m, 0.0, 0.3), speed, 0.0)


def inputs(offset_s: float = 0.0, lag_s: float = 0.1, at_s: float = 10.0) -> LatestInputs:
    """Both streams at ``at_s``; the robot's clock is off by ``offset_s``."""
    now_ns = int((at_s + offset_s) * SECOND)
    start = with_odometry(LatestInputs(), odometry(1, now_ns), at_s)
    return with_revision(start, revision(1, now_ns - int(lag_s * SECOND)), at_s)


def test_a_robot_that_may_not_obey_holds_the_planner_as_long_as_it_says_so() -> None:
    held = with_odometry(inputs(), replace(odometry(2, 10 * SECOND), hold="it may drive"), 10.1)
    assert held.stale_reason(10.1, FRESH) == "it may drive"
    there = with_odometry(held, replace(odometry(3, 10 * SECOND), reached=(1.0, 2.0, 0.5)), 10.2)
    assert there.stale_reason(10.2, FRESH) == ""
    assert (there.reached, held.reached) == (Pose2d(1.0, 2.0, 0.5), None)


def test_the_odometer_counts_driving_only() -> None:
    state = with_odometry(LatestInputs(), odometry(1, 0, 0.0), 0.0)
    state = with_odometry(state, odometry(2, 0, 0.3), 0.1)
    assert state.odometer_m == pytest.approx(0.3)
    carried = with_odometry(state, odometry(3, 0, 8.0), 0.2)
    assert carried.odometer_m == pytest.approx(0.3)
    trembling = with_odometry(state, odometry(3, 0, 0.31, speed=0.0), 0.2)
    assert trembling.odometer_m == pytest.approx(0.3)
    sideways = replace(odometry(3, 0, 0.5, speed=0.0), lateral_mps=-0.2)
    assert with_odometry(state, sideways, 0.2).odometer_m == pytest.approx(0.5)
    assert trembling.pose is not None
    assert trembling.pose.yaw_rad == pytest.approx(0.3)


def test_a_robot_that_tells_no_speed_has_driven_too() -> None:
    """As one made from the example: 10 m on a circle of 0.5 m."""
    state = LatestInputs()
    for tick in range(400):
        angle = tick * 0.025 / 0.5
        pose = pose_2d(0.5 * math.cos(angle), 0.5 * math.sin(angle), angle)
        message = replace(odometry(tick, 0, speed=0.0), T_map_body=pose)
        state = with_odometry(state, message, tick / 20)
    assert 9.6 < state.odometer_m <= 10.0


def test_a_collision_is_remembered_until_the_next_plan() -> None:
    hit = replace(odometry(1, 0), collided=True)
    state = with_odometry(with_odometry(LatestInputs(), hit, 3.0), odometry(2, 0), 3.1)
    assert state.collided_s == 3.0


@pytest.mark.parametrize(
    ("revision", "frames", "another"),
    [
        pytest.param(11, 11, False, id="one frame more"),
        pytest.param(14, 13, False, id="some missed, one reset among them"),
        pytest.param(11, 0, True, id="cleared"),
        pytest.param(11, 500, True, id="another one loaded"),
        pytest.param(3, 3, True, id="the mapper was restarted"),
    ],
)
def test_another_map_is_noticed_whatever_its_size(
    revision: int, frames: int, another: bool
) -> None:
    def revision_of(revision: int, frames: int) -> MapRevision:
        return MapRevision(revision, 1, 1, "e", "s", frames, 10, 10, 1.0, 8.0)

    inputs = with_revision(LatestInputs(), revision_of(10, 10), 0.0)
    after = with_revision(inputs, revision_of(revision, frames), 1.0)
    assert (after.map_count > inputs.map_count) == another
    exchanged = another and revision > 10  # a restarted mapper still has what was found
    assert (after.exchange_count > inputs.exchange_count) == exchanged


@pytest.mark.parametrize(("map_id", "another"), [("m1", False), ("m2", True)])
@pytest.mark.parametrize(("revision", "frames"), [(11, 10), (11, 0), (11, 500), (3, 3)])
def test_the_map_s_id_says_whether_it_is_another_one(
    map_id: str, another: bool, revision: int, frames: int
) -> None:
    known = MapRevision(10, 1, 1, "e", "s", 10, 10, 10, 1.0, 8.0, map_id="m1")
    inputs = with_revision(LatestInputs(), known, 0.0)
    now = replace(known, revision=revision, frames_fused=frames, map_id=map_id)
    assert (with_revision(inputs, now, 1.0).map_count > inputs.map_count) == another


def test_the_map_s_period_is_measured_at_its_frames() -> None:
    state = inputs()
    for k in range(2, 8):
        now_s = 10.0 + 0.5 * (k - 1)
        state = with_odometry(state, odometry(k, int(now_s * SECOND)), now_s)
        state = with_revision(state, revision(k, int((now_s - 0.3) * SECOND)), now_s)
    last_s = 13.0
    assert state.ages(last_s).map_period_s == pytest.approx(0.5)
    late = with_odometry(state, odometry(9, int((last_s + 3) * SECOND)), last_s + 3)
    assert late.ages(last_s + 3).map_period_s == pytest.approx(0.5)  # a pause is no slow map
    awake = with_odometry(state, odometry(9, int((last_s + 0.9) * SECOND)), last_s + 0.9)
    assert awake.stale_reason(last_s + 0.9, FRESH) == ""
    assert late.stale_reason(last_s + 3, FRESH) == "waiting for the map: none for 3.0 s"


def test_a_revision_without_a_new_frame_is_not_fresh() -> None:
    """A search that begins resets a layer: a new revision of an old map."""
    before = inputs()
    same = revision(1, 10 * SECOND - SECOND // 10)
    after = with_revision(before, replace(same, revision=2), 10.6)
    assert after.ages(10.6).map_s == pytest.approx(0.6)


def test_patience_begins_with_inputs_and_again_with_each_process_that_comes_or_goes() -> None:
    members = frozenset({("ros2", "r"), ("mapper", "m1"), ("gateway", "g1")})
    deaf = with_revision(LatestInputs(), revision(1, 1), 10.0)
    assert deaf.patience_from_s(50.0) == -math.inf  # no robot drives off at its start
    assert with_members(LatestInputs(), members, 1.0).patience_from_s(50.0) == 50.0  # none heard
    heard = with_members(inputs(at_s=10.0), members, 10.0)
    assert heard.patience_from_s(50.0) == 10.0
    assert with_members(heard, members, 20.0).patience_from_s(50.0) == 10.0
    others = members - {("gateway", "g1"), ("ros2", "r")}
    assert with_members(heard, others, 20.0).patience_from_s(50.0) == 10.0  # no stage
    gone = with_members(heard, others - {("mapper", "m1")}, 30.0)
    assert gone.patience_from_s(50.0) == 30.0
    assert with_members(gone, others | {("mapper", "m2")}, 40.0).patience_from_s(50.0) == 40.0


def test_a_stage_that_starts_says_so_as_long_as_it_does() -> None:
    beat = Heartbeat("mapper", "m1", 1, 1, False, "compiling: 20 of about 45 s", {"start_s": 20.0})
    told = with_start(inputs(at_s=10.0), beat, 20.0)
    assert told.stale_reason(20.5, FRESH) == "waiting for the mapper: compiling: 20 of about 45 s"
    assert told.patience_from_s(20.5) == 20.0
    ended = "waiting for the robot's position: none for 20.5 s"  # the start, on the way
    assert told.stale_reason(30.5, FRESH) == ended
    assert told.stale_reason(10.2, FRESH) == ""  # beside fresh inputs nothing waits for it


def test_what_comes_late_to_an_adapter_that_names_commands_at_once_stops_the_robot() -> None:
    """The adapter's echo is prompt; the base's odometry slides to 1.6 s late."""
    state, reasons, delivery_s = LatestInputs(loop=LoopMonitor("p")), [], []
    for count in range(1, 80):
        now_s = 10.0 + 0.05 * count
        late_s = 0.05 + max(0.04 * (count - 40), 0.0)
        stamp_ns = int((now_s - late_s) * SECOND)
        state = with_sent(state, SentCommand(count, now_s - 0.02))
        heard = replace(odometry(count, stamp_ns), planner="p", command_sequence=count)
        state = with_odometry(state, heard, now_s)
        state = with_revision(state, revision(count, stamp_ns), now_s)
        reasons.append(state.stale_reason(now_s, FRESH))
        delivery_s.append(state.for_controller("s", now_s, FRESH).delivery_s)
    assert set(reasons[:47]) == {""}  # up to 0.3 s later than usual
    assert all(each.startswith("waiting for the robot's position") for each in reasons[47:])
    assert delivery_s[44] - delivery_s[0] == pytest.approx(2 * 5 * 0.04, abs=1e-6)
