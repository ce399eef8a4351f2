from __future__ import annotations

import numpy as np
import pytest

from onemap_ros2.config import Ros2Config
from onemap_ros2.robot_input import RobotInput
from onemap_shared.geometry import pose_2d
from tests.ros2.robot_messages import HEIGHT, WIDTH, camera_info, image, odometry, transforms

T0 = 1_700_000_000_000_000_000
MS = 1_000_000
RGB = np.full((HEIGHT, WIDTH, 3), 7, np.uint8)
DEPTH = np.full((HEIGHT, WIDTH), 1500, np.uint16)


def robot(**settings: object) -> RobotInput:
    """With a camera on a base that drives 1 m in 100 ms after T0."""
    made = RobotInput(Ros2Config.model_validate(settings))
    made.add("tf_static", transforms(0, ("base_link", "camera", 0.2, 0.0)), 0.0)
    for ms in (0, 100):
        edges = (("map", "odom", 5.0, 0.0), ("odom", "base_link", ms * 1e-2, 0.0))
        made.add("tf", transforms(T0 + ms * MS, *edges), 0.0)
    made.add("camera_info", camera_info(T0), 0.0)
    return made


def show(made: RobotInput, stamp_ns: int, depth: np.ndarray = DEPTH) -> None:
    encoding = "16UC1" if depth.dtype == np.uint16 else "32FC1"
    made.add("color", image(stamp_ns, RGB, "rgb8"), 0.0)
    made.add("depth", image(stamp_ns, depth, encoding), 0.0)


@pytest.mark.parametrize("depth", [DEPTH, np.full((HEIGHT, WIDTH), 1.5, np.float32)])
def test_a_pair_becomes_a_frame_with_the_pose_at_its_stamp(depth: np.ndarray) -> None:
    made = robot()
    show(made, T0 + 50 * MS, depth)
    frame = made.take_frame(0.0)
    assert frame is not None
    assert (frame.sequence, frame.stamp_ns) == (0, T0 + 50 * MS)
    np.testing.assert_array_equal(frame.rgb, RGB)
    np.testing.assert_array_equal(frame.depth_mm, DEPTH)
    np.testing.assert_allclose(frame.T_map_camera, pose_2d(5.7, 0.0, 0.0), atol=1e-6)
    assert made.take_frame(0.0) is None


def test_a_frame_waits_for_its_transform() -> None:
    made = robot()
    show(made, T0 + 150 * MS)
    assert made.take_frame(0.0) is None
    edges = (("map", "odom", 5.0, 0.0), ("odom", "base_link", 2.0, 0.0))
    made.add("tf", transforms(T0 + 200 * MS, *edges), 0.1)
    frame = made.take_frame(0.1)
    assert frame is not None
    assert frame.T_map_camera[0, 3] == pytest.approx(5.0 + 1.5 + 0.2)


def test_a_frame_whose_transform_never_comes_is_dropped_and_counted() -> None:
    made = robot(transform_wait_ms=200)
    show(made, T0 + 150 * MS)
    assert made.take_frame(0.0) is None
    assert made.take_frame(0.25) is None
    assert made.counts.no_transform == 1
    assert "ends 0.050 s before" in made.problem


def test_the_rate_is_bounded_by_stamps() -> None:
    made = robot(frame_rate_hz=10)
    taken = 0
    for ms in range(0, 101, 20):
        show(made, T0 + ms * MS)
        taken += made.take_frame(0.0) is not None
    assert taken == 2


def test_depth_of_another_size_is_refused_by_name() -> None:
    made = robot()
    show(made, T0, DEPTH[:, :4])
    assert made.take_frame(0.0) is None
    assert made.counts.unusable == 1
    assert "registered to the color image" in made.problem


def test_without_camera_information_there_is_no_frame() -> None:
    made = RobotInput(Ros2Config())
    show(made, T0)
    assert not made.has_camera
    assert made.take_frame(0.0) is None


def test_odometry_is_placed_on_the_map() -> None:
    made = robot()
    made.add("odometry", odometry(T0 + 20 * MS, 0.5, 0.3, 0.4), 0.0)
    message = made.take_odometry(0.0)
    assert message is not None
    np.testing.assert_allclose(message.T_map_body, pose_2d(5.5, 0.0, 0.3), atol=1e-9)
    assert (message.stamp_ns, message.linear_mps) == (T0 + 20 * MS, 0.4)
    assert made.take_odometry(0.0) is None


def test_odometry_waits_for_its_transform_and_is_dropped_after_it() -> None:
    made = robot()
    made.add("odometry", odometry(T0 + 150 * MS), 0.0)
    assert made.take_odometry(0.1) is None
    assert made.counts.no_transform == 0
    assert made.take_odometry(0.3) is None
    assert made.counts.no_transform == 1


def test_a_clock_that_jumps_back_begins_anew() -> None:
    made = robot(map_frame="odom")
    made.add("odometry", odometry(T0), 0.0)
    assert made.take_odometry(0.0) is not None
    made.add("odometry", odometry(5 * 10**9), 0.0)
    assert made.counts.clock_jumps == 1
    assert made.take_odometry(0.0) is not None
    show(made, 5 * 10**9)
    assert made.take_frame(0.0) is None  # no transform of the new time yet
    for seconds in (4, 6):
        made.add("tf", transforms(seconds * 10**9, ("odom", "base_link", 1.0, 0.0)), 0.0)
    frame = made.take_frame(0.1)
    assert frame is not None
    assert frame.T_map_camera[0, 3] == pytest.approx(1.2)


@pytest.mark.parametrize("kind", ["color", "depth", "camera_info", "odometry", "tf", "tf_static"])
def test_garbage_is_counted_and_named(kind: str) -> None:
    made = robot()
    made.add(kind, b"\x00\x01\x00", 0.0)
    assert made.counts.unusable == 1
    assert "3 bytes" in made.problem


def test_odometry_that_is_not_finite_is_refused() -> None:
    made = robot()
    made.add("odometry", odometry(T0, float("nan")), 0.0)
    made.add("odometry", odometry(T0, linear_mps=float("inf")), 0.0)
    assert made.take_odometry(0.0) is None
    assert made.counts.unusable == 2
