"""No command lets the robot's disc come to rest on what the map does not know to be free."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_planner.motion.accelerations import nearest_edges
from onemap_planner.motion.collision_monitor import (
    CORNER_M,
    SLACK_M,
    USUAL_DELIVERY_S,
    WALKER_MPS,
    CheckedCommand,
    ControlTimes,
    monitored,
)
from onemap_planner.motion.motions import STOP, Pose2d, moved
from onemap_planner.motion.pure_pursuit import DriveParams, limit_acceleration
from onemap_planner.world.costmap import Costmap
from onemap_shared.geometry import F64, Bool, Velocity2d
from onemap_shared.messages import Occupancy
from tests.planner.drawn_maps import CELL_M, PARAMS, costmap_of, crossable, drawn_map

DRIVE, SIZE = PARAMS.drive, PARAMS.costmap
HOLONOMIC = DRIVE.model_copy(update={"max_lateral_mps": 0.4})
DT_S = 0.05
ONE_DROP = np.ones((12, 12), np.uint8)
ONE_DROP[2, 5] = 3  # between two points of a path the disc came 0.7 mm over it
OPEN = drawn_map(*["." * 10] * 10, scale=5)

speeds = st.builds(Velocity2d, st.floats(-0.7, 0.7), st.floats(-1.5, 1.5))
vectors = st.builds(Velocity2d, st.floats(-0.7, 0.7), st.floats(-1.5, 1.5), st.floats(-0.4, 0.4))
headings = st.floats(-math.pi, math.pi)
arrivals_s = st.sampled_from([0.0, USUAL_DELIVERY_S])  # of a command, after it was checked


def checked(
    command: Velocity2d,
    before: Velocity2d,
    pose: Pose2d,
    costmap: Costmap,
    params: DriveParams = DRIVE,
) -> Velocity2d:
    times = ControlTimes(DT_S)
    return monitored(command, before, pose, costmap, params, times=times).velocity


def last_command(
    checked: CheckedCommand, before: Velocity2d, pose: Pose2d, params: DriveParams, arrives_s: float
) -> F64:
    """Positions (N, 2), metres, of a robot that gets no other command, every 20 ms until it stands.

    It keeps its velocity until this one arrives, follows it while it holds, then brakes.
    """
    dt_s, velocity, points = 0.02, before, [pose.xy]
    for tick in range(70):
        now_s = tick * dt_s
        holds = now_s < arrives_s + checked.validity_s
        target = before if now_s < arrives_s else checked.velocity if holds else STOP
        velocity = limit_acceleration(target, velocity, dt_s, params)
        pose = moved(pose, velocity, dt_s)
        points.append(pose.xy)
    return np.array(points)


def touches(points: F64, cells: Bool, radius_m: float) -> bool:
    """Whether a disc at one of the points (N, 2) reaches into a cell of the mask (nx, ny)."""
    centres = (np.argwhere(cells) + 0.5) * CELL_M
    beside = np.maximum(np.abs(points[:, None] - centres) - CELL_M / 2, 0.0)
    return bool((np.hypot(*beside.transpose(2, 0, 1)) < radius_m - 1e-4).any())


@settings(deadline=None, max_examples=60)
@given(
    arrays(np.uint8, (12, 12), elements=st.sampled_from([0, 1, 1, 1, 1, 1, 1, 1, 2])),
    speeds | vectors,
    headings,
    arrivals_s,
)
def test_whatever_command_is_the_last_the_robot_stands_on_the_known_free_floor(
    occupancy: np.ndarray, command: Velocity2d, yaw_rad: float, arrives_s: float
) -> None:
    occupancy[4:8, 4:8] = Occupancy.FREE
    map_view = replace(drawn_map(*["." * 12] * 12), occupancy=occupancy)
    costmap = costmap_of(map_view, (0.6, 0.6), SIZE)
    assume(not crossable(costmap).any())
    pose, velocity = Pose2d(0.6, 0.6, yaw_rad), STOP
    unknown = ~(costmap.free | costmap.occupied)
    for _ in range(30):
        wanted = limit_acceleration(command, velocity, DT_S, HOLONOMIC)
        times = ControlTimes(DT_S)
        passed = monitored(wanted, velocity, pose, costmap, HOLONOMIC, times=times)
        ends = last_command(passed, velocity, pose, HOLONOMIC, arrives_s)
        velocity = limit_acceleration(passed.velocity, velocity, DT_S, HOLONOMIC)
        pose = moved(pose, velocity, DT_S)
        assert not touches(ends, costmap.occupied, SIZE.radius_m - CORNER_M - 2 * SLACK_M)
        known_m = max(SIZE.radius_m - SIZE.unknown_overlap_m - 2 * SLACK_M, 1e-3)
        assert not touches(ends, unknown, known_m)


@settings(deadline=None, max_examples=60)
@given(
    arrays(np.uint8, (12, 12), elements=st.sampled_from([0, 1, 1, 1, 1, 1, 1, 3])),
    speeds | vectors,
    headings,
    arrivals_s,
)
@example(ONE_DROP, Velocity2d(-0.34375, -0.59375, 0.1640625), 1.71875, USUAL_DELIVERY_S)
def test_no_part_of_it_comes_over_a_drop_nor_over_unseen_floor_beside_one(
    letters: np.ndarray, command: Velocity2d, yaw_rad: float, arrives_s: float
) -> None:
    """Whichever command is the last; nor on its own trail, where it creeps nearer to obstacles."""
    letters = letters.copy()
    letters[3:9, 3:9] = Occupancy.FREE
    rows = ["".join(" .#v"[each] for each in row) for row in letters]
    trail = np.column_stack([np.linspace(0.05, 0.6, 12), np.full(12, 0.6)])
    trail = np.vstack([trail, np.tile([[0.6, 0.6]], (10, 1))])
    costmap = costmap_of(drawn_map(*rows), (0.6, 0.6), SIZE, trail_xy=trail)
    pose, velocity = Pose2d(0.6, 0.6, yaw_rad), STOP
    for _ in range(40):
        wanted = limit_acceleration(command, velocity, DT_S, HOLONOMIC)
        times = ControlTimes(DT_S)
        passed = monitored(wanted, velocity, pose, costmap, HOLONOMIC, times=times)
        ends = last_command(passed, velocity, pose, HOLONOMIC, arrives_s)
        velocity = limit_acceleration(passed.velocity, velocity, DT_S, HOLONOMIC)
        pose = moved(pose, velocity, DT_S)
        assert not touches(ends, costmap.drops, SIZE.radius_m)


@given(speeds | vectors, speeds | vectors, headings)
@settings(deadline=None)
def test_in_the_open_every_command_passes(
    wanted: Velocity2d, before: Velocity2d, yaw_rad: float
) -> None:
    command = limit_acceleration(wanted, before, DT_S, HOLONOMIC)
    costmap = costmap_of(OPEN, (2.5, 2.5), SIZE)
    assert checked(command, before, Pose2d(2.5, 2.5, yaw_rad), costmap, HOLONOMIC) == command


def test_sideways_it_slows_down_and_stops_before_a_wall() -> None:
    costmap = costmap_of(drawn_map("#" * 10, *["." * 10] * 9, scale=5), (2.5, 2.5), SIZE)
    pose, velocity = Pose2d(2.5, 2.5, math.pi / 2), STOP  # the wall, below x = 0.5, is to its left
    for _ in range(400):
        wanted = limit_acceleration(Velocity2d(lateral_mps=0.4), velocity, DT_S, HOLONOMIC)
        velocity = checked(wanted, velocity, pose, costmap, HOLONOMIC)
        pose = moved(pose, velocity, DT_S)
    assert velocity.speed_mps < 0.02
    assert SIZE.radius_m - SLACK_M - 1e-3 <= pose.x_m - 0.5 < SIZE.radius_m + 0.03
    assert pose.y_m == pytest.approx(2.5)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("ahead", ["#", " "])
def test_it_slows_down_and_stops_before_what_is_not_free(direction: int, ahead: str) -> None:
    rows = (ahead * 10, *["." * 10] * 8, ahead * 10)
    costmap = costmap_of(drawn_map(*rows, scale=5), (2.5, 2.5), SIZE)
    pose, velocity, speeds_mps = Pose2d(2.5, 2.5, 0.0), STOP, []
    for _ in range(400):
        target = Velocity2d(direction * (0.7 if direction > 0 else 0.15), 0.0)
        wanted = limit_acceleration(target, velocity, DT_S, DRIVE)
        velocity = checked(wanted, velocity, pose, costmap)
        pose = moved(pose, velocity, DT_S)
        speeds_mps.append(abs(velocity.linear_mps))
    keeps_m = SIZE.radius_m if ahead == "#" else -CORNER_M
    gap_m = min(4.5 - pose.x_m, pose.x_m - 0.5)
    assert keeps_m - SLACK_M - 1e-3 <= gap_m < keeps_m + 0.03
    assert speeds_mps[-1] < 0.02
    assert ahead == "#" or DRIVE.unseen_mps in speeds_mps
    braking = np.diff(speeds_mps[speeds_mps.index(max(speeds_mps)) :])
    assert (braking >= -DRIVE.max_linear_mps2 * DT_S - 1e-9).all()


@pytest.mark.parametrize(("off_its_side_deg", "moves"), [(10.0, True), (60.0, False)])
def test_it_creeps_past_an_obstacle_but_not_at_it(off_its_side_deg: float, moves: bool) -> None:
    costmap = costmap_of(drawn_map("." * 10, "#" * 10, scale=5), (0.3, 2.5), SIZE)
    pose = Pose2d(0.3045, 2.5, math.radians(90.0 - off_its_side_deg))  # the wall begins at x = 0.5
    command = checked(Velocity2d(DRIVE.unseen_mps), Velocity2d(DRIVE.unseen_mps), pose, costmap)
    assert (command.linear_mps == DRIVE.unseen_mps) == moves
    faster = Velocity2d(0.1, 0.0)
    assert checked(faster, faster, pose, costmap).linear_mps < 0.1


def test_before_a_wall_it_turns_in_place() -> None:
    costmap = costmap_of(drawn_map("." * 10, "#" * 10, scale=5), (0.29, 2.5), SIZE)
    command = checked(Velocity2d(0.05, 0.15), STOP, Pose2d(0.3199, 2.5, 0.0), costmap)
    assert command == Velocity2d(0.0, 0.15)


def test_a_robot_that_is_too_near_may_only_leave() -> None:
    costmap = costmap_of(drawn_map("." * 10, "#" * 10, scale=5), (0.35, 2.5), SIZE)
    towards, away = Pose2d(0.35, 2.5, 0.0), Pose2d(0.35, 2.5, math.pi)
    assert checked(Velocity2d(0.05, 0.0), STOP, towards, costmap) == STOP
    assert checked(Velocity2d(-0.05, 0.0), STOP, towards, costmap).linear_mps == -0.05
    assert checked(Velocity2d(0.05, 0.0), STOP, away, costmap).linear_mps == 0.05


def test_the_own_trail_is_crept_along_through_a_door_that_noise_narrowed() -> None:
    """At the speed of a harmless touch: backwards at 0.15 m/s the robot ran into furniture."""
    map_view = drawn_map(*["......"] * 2, "######", *["......"] * 2, scale=5)
    map_view.occupancy[10:15, 13:17] = Occupancy.FREE
    out = np.column_stack([np.linspace(0.55, 1.95, 15), np.full(15, 1.45)])
    there = np.column_stack([np.full(12, 1.95), np.linspace(1.35, 0.25, 12)])
    trail = np.vstack([out, there])  # and back to the door
    pose = Pose2d(1.6, 1.46, math.pi)
    on_trail = costmap_of(map_view, pose.xy, SIZE, trail_xy=trail)
    creeping, slow = Velocity2d(DRIVE.unseen_mps, 0.0), Velocity2d(0.15, 0.0)
    assert checked(creeping, creeping, pose, on_trail) == creeping
    assert checked(slow, slow, pose, on_trail).linear_mps < slow.linear_mps
    assert checked(slow, STOP, pose, on_trail) == creeping
    for other in (costmap_of(map_view, pose.xy, SIZE, trail_xy=out[-3:]),):
        assert pose_after(slow, pose, other).x_m > 1.4
    assert pose_after(slow, pose, on_trail, 300).x_m < 1.0


def test_an_escape_crosses_unseen_floor_slowly_and_not_far() -> None:
    hole = np.array(OPEN.occupancy)
    hole[5:20, 5:20] = Occupancy.UNKNOWN
    strict = SIZE.model_copy(update={"unknown_overlap_m": 0.1})
    near = costmap_of(replace(OPEN, occupancy=hole), (1.0, 1.25), strict)
    assert crossable(near)[7, 12]
    slow, fast, pose = Velocity2d(-0.04, 0.0), Velocity2d(-0.1, 0.0), Pose2d(1.0, 1.25, 0.0)
    assert checked(slow, slow, pose, near) == slow
    assert checked(fast, fast, pose, near) != fast
    nothing = costmap_of(drawn_map(*[" " * 10] * 10, scale=5), (2.5, 2.5), SIZE)
    beside = nothing.grid.centres(np.argwhere(crossable(nothing))) - (2.5, 2.5)
    assert np.hypot(*beside.T).max() <= SIZE.radius_m + CELL_M  # only where it stands
    centre = Pose2d(2.5, 2.5, 0.0)
    for command in (Velocity2d(0.15, 0.0), Velocity2d(-0.15, 0.0)):
        end = pose_after(command, centre, nothing)
        assert end.distance_to(centre.xy) < SIZE.radius_m + CELL_M


@pytest.mark.parametrize(
    ("beside", "start_x_m", "limit_mps"),
    [
        pytest.param(" ", 2.2, DRIVE.unseen_mps, id="unknown, at the start"),
        pytest.param("a", 0.5, DRIVE.unseen_mps, id="assumed, away from the start"),
        pytest.param("a", 2.2, DRIVE.blind_mps, id="assumed, at the start: below the image"),
    ],
)
def test_the_body_comes_over_what_no_camera_saw_slowly(
    beside: str, start_x_m: float, limit_mps: float
) -> None:
    rows = [*["." * 10] * 5, *[beside * 10] * 5]
    start = np.array([[start_x_m, 2.5]])
    costmap = costmap_of(drawn_map(*rows, scale=5), (2.2, 2.5), SIZE, trail_xy=start)
    velocity, pose, border_m = Velocity2d(0.7, 0.0), Pose2d(1.5, 2.5, 0.0), 2.5 - SIZE.radius_m
    speeds_mps = []
    for _ in range(200):
        wanted = limit_acceleration(Velocity2d(0.7, 0.0), velocity, DT_S, DRIVE)
        velocity = checked(wanted, velocity, pose, costmap)
        pose = moved(pose, velocity, DT_S)
        if border_m + SLACK_M < pose.x_m < start_x_m + costmap.params.blind_m - SIZE.radius_m:
            speeds_mps.append(velocity.linear_mps)
        elif border_m + SLACK_M < pose.x_m:
            assert velocity.linear_mps <= DRIVE.unseen_mps + 1e-9
    if limit_mps == DRIVE.blind_mps:
        assert max(speeds_mps) == pytest.approx(limit_mps)
    assert pose.x_m > border_m + 0.1
    assert (pose.x_m > 2.6) == (beside == "a")  # assumed floor is floor, unknown cells are not


@pytest.mark.parametrize(("contact_y_m", "blind"), [(1.5, False), (4.5, True)])
def test_a_contact_at_the_start_says_that_things_stand_there(
    contact_y_m: float, blind: bool
) -> None:
    rows, contact = [*["." * 10] * 5, *["a" * 10] * 5], np.array([[2.7, contact_y_m]])
    costmap = costmap_of(drawn_map(*rows, scale=5), (2.2, 2.5), SIZE, obstacles_xy=contact)
    assert costmap.blind.any() == blind
    onwards = pose_after(Velocity2d(0.7, 0.0), Pose2d(1.5, 2.5, 0.0), costmap)
    assert (onwards.x_m > 2.8) == blind


def test_a_body_that_is_over_it_creeps_along_and_drives_away() -> None:
    rows = [*["." * 10] * 5, *[" " * 10] * 5]
    costmap = costmap_of(drawn_map(*rows, scale=5), (2.4, 2.5), SIZE)
    along, away = Pose2d(2.4, 2.5, math.pi / 2), Pose2d(2.4, 2.5, math.pi)
    command = Velocity2d(0.3, 0.0)
    assert checked(command, STOP, along, costmap).linear_mps == DRIVE.unseen_mps
    assert checked(command, command, away, costmap) == command


def pose_after(command: Velocity2d, pose: Pose2d, costmap: Costmap, steps: int = 100) -> Pose2d:
    """The pose after five seconds, or other steps, of this command, checked."""
    velocity = STOP
    for _ in range(steps):
        wanted = limit_acceleration(command, velocity, DT_S, DRIVE)
        velocity = checked(wanted, velocity, pose, costmap)
        pose = moved(pose, velocity, DT_S)
    return pose


@pytest.mark.parametrize("own_m", [0.0, 0.1, 0.25], ids=["nothing", "its middle", "its body"])
def test_no_wall_is_driven_into_because_the_map_shows_the_robot_itself(own_m: float) -> None:
    """Another robot of the same map sees it, all the way, as an obstacle."""
    room = drawn_map(*["." * 30] * 24, *["#" * 30] * 6)
    cells = np.argwhere(np.ones(room.grid.shape, bool))
    pose, velocity, ahead = Pose2d(0.8, 1.5, 0.0), STOP, Velocity2d(0.4, 0.0)
    for _ in range(100):
        occupancy = room.occupancy.copy()
        away_m = np.hypot(*(room.grid.centres(cells) - pose.xy).T)
        occupancy[tuple(cells[away_m < own_m].T)] = Occupancy.OCCUPIED
        costmap = costmap_of(replace(room, occupancy=occupancy), pose.xy, SIZE)
        wanted = limit_acceleration(ahead, velocity, DT_S, DRIVE)
        velocity = checked(wanted, velocity, pose, costmap)
        pose = moved(pose, velocity, DT_S)
    assert pose.x_m + SIZE.radius_m == pytest.approx(2.4, abs=0.11)


def hall_with_somebody(at_m: float) -> Costmap:
    """Free floor with the front of somebody, three cells, who has appeared at x = at_m."""
    map_view = replace(OPEN, occupancy=OPEN.occupancy.copy())
    map_view.occupancy[round(at_m / CELL_M), 24:27] = Occupancy.OCCUPIED
    cells = np.argwhere(map_view.occupancy == Occupancy.OCCUPIED)
    return costmap_of(map_view, (2.5, 2.5), SIZE, appeared_xy=map_view.grid.centres(cells))


@given(st.floats(2.9, 4.5), speeds | vectors, headings, st.floats(0.0, 0.5))
@settings(deadline=None, max_examples=60)
def test_whoever_walks_up_to_it_does_not_meet_it_coming_nearer(
    at_m: float, command: Velocity2d, yaw_rad: float, map_age_s: float
) -> None:
    """As far as they can come from where the map saw them, while no other frame arrives."""
    costmap = hall_with_somebody(at_m)
    centres = costmap.grid.centres(np.argwhere(costmap.appeared))
    pose, velocity = Pose2d(2.5, 2.5, yaw_rad), STOP
    away_m = float(nearest_edges(np.array([pose.xy]), centres, CELL_M)[0])
    for step in range(40):
        seen_s = map_age_s + step * DT_S
        wanted = limit_acceleration(command, velocity, DT_S, HOLONOMIC)
        times = ControlTimes(DT_S, seen_s)
        velocity = monitored(wanted, velocity, pose, costmap, HOLONOMIC, times=times).velocity
        pose = moved(pose, velocity, DT_S)
        before_m, away_m = away_m, float(nearest_edges(np.array([pose.xy]), centres, CELL_M)[0])
        come_m = WALKER_MPS * (seen_s + DT_S)
        assert away_m >= min(SIZE.radius_m + come_m, before_m) - 0.01


def test_who_is_near_does_not_hold_it_there() -> None:
    costmap, pose = hall_with_somebody(2.9), Pose2d(2.5, 2.5, 0.0)
    times = ControlTimes(DT_S, 0.25)
    forwards, turning = Velocity2d(0.05, 0.0), Velocity2d(0.0, 0.1)
    backwards = Velocity2d(-0.05, 0.0)
    for wanted, allowed in ((forwards, STOP), (backwards, backwards), (turning, turning)):
        passed = monitored(wanted, STOP, pose, costmap, DRIVE, times=times)
        assert passed.velocity == allowed
