from __future__ import annotations

import struct

import cv2
import numpy as np
import pytest

from onemap_ros2.config import Ros2Config
from onemap_ros2.robot_input import PairBuffer, RobotInput
from onemap_shared.geometry import pose_2d
from tests.ros2.robot_messages import (
    HEIGHT,
    WIDTH,
    camera_info,
    compressed,
    image,
    odometry,
    transforms,
)

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


def show(made: RobotInput, stamp_ns: int, depth: np.ndarray = DEPTH, frame: str = "camera") -> None:
    encoding = "16UC1" if depth.dtype == np.uint16 else "32FC1"
    made.add("color", image(stamp_ns, RGB, "rgb8", frame), 0.0)
    made.add("depth", image(stamp_ns, depth, encoding, frame), 0.0)


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


def test_a_frame_waits_for_its_transform_and_is_dropped_if_it_never_comes() -> None:
    made = robot()
    show(made, T0 + 150 * MS)
    assert made.take_frame(0.0) is None
    edges = (("map", "odom", 5.0, 0.0), ("odom", "base_link", 2.0, 0.0))
    made.add("tf", transforms(T0 + 200 * MS, *edges), 0.1)
    frame = made.take_frame(0.1)
    assert frame is not None
    assert frame.T_map_camera[0, 3] == pytest.approx(5.0 + 1.5 + 0.2)
    show(made, T0 + 250 * MS)
    assert made.take_frame(0.2) is None
    assert made.counts.no_transform == 0
    assert made.take_frame(0.45) is None
    assert made.counts.no_transform == 1
    assert "ends 0.050 s before" in made.problem


def test_the_rate_is_bounded_by_stamps() -> None:
    made = robot()
    taken = 0
    for ms in range(0, 101, 20):  # 60 ms, less a tenth of it
        show(made, T0 + ms * MS)
        taken += made.take_frame(0.0) is not None
    assert taken == 2


def test_a_camera_that_stamps_all_images_alike_is_named() -> None:
    made = robot()
    for now_s in (0.0, 0.5, 2.0):
        show(made, T0)
        made.take_frame(now_s)
    assert made.counts.frames == 1
    assert "aligned_depth_to_color/image_raw hardly advance: by 0.000 s in 2.0 s" in made.problem


def test_depth_of_another_size_is_refused_by_name() -> None:
    made = robot()
    show(made, T0, DEPTH[:, :4])
    assert made.take_frame(0.0) is None
    assert made.counts.unusable == 1
    assert "registered to the color image" in made.problem


def test_odometry_is_placed_on_the_map_or_dropped_after_it_has_waited() -> None:
    made = robot()
    made.add("odometry", odometry(T0 + 20 * MS, 0.5, 0.3, 0.4, -0.1), 0.0)
    message = made.take_odometry(0.0)
    assert message is not None
    np.testing.assert_allclose(message.T_map_body, pose_2d(5.5, 0.0, 0.3), atol=1e-9)
    assert (message.stamp_ns, message.linear_mps) == (T0 + 20 * MS, 0.4)
    assert message.lateral_mps == -0.1
    made.add("odometry", odometry(T0 + 150 * MS), 0.0)
    assert made.take_odometry(0.1) is None
    assert made.counts.no_transform == 0
    assert made.take_odometry(0.3) is None
    assert made.counts.no_transform == 1


@pytest.mark.parametrize("kind", ["tf", "tf_static"])
def test_a_transform_that_cannot_be_one_leaves_the_others_of_its_message(kind: str) -> None:
    made = RobotInput(Ros2Config.model_validate({"map_frame": "odom"}))
    good = ("odom", "base_link", 1.0, 0.0), ("base_link", "camera", 0.2, 0.0)
    nan = float("nan")
    wrong = ("base_link", "arm", nan, 0.0), ("hand", "hand", 0.1, 0.0), ("arm", "hand", 0.1, nan)
    made.add(kind, transforms(T0, wrong[0], good[0], *wrong[1:], good[1]), 0.0)
    made.add("camera_info", camera_info(T0), 0.0)
    assert made.counts.unusable == 3
    assert made.problem == f"the transform of 'hand' in 'arm' on /{kind} contains NaN or infinity"
    show(made, T0)
    frame = made.take_frame(0.0)
    assert frame is not None, made.problem
    assert frame.T_map_camera[0, 3] == pytest.approx(1.2)
    show(made, T0 + 100 * MS, frame="hand")  # what needs one of them says why there is none
    made.take_frame(0.0)
    assert made.take_frame(1.0) is None
    assert f"'hand' in 'arm' on /{kind} contains NaN" in made.problem


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


def test_compressed_images_become_the_same_frame() -> None:
    topics = {"color": "/c/image/compressed", "depth": "/d/image/compressedDepth"}
    made = robot(topics=topics)
    stamp_ns = T0 + 50 * MS
    png = bytes(cv2.imencode(".png", DEPTH)[1])
    color = bytes(cv2.imencode(".png", RGB)[1])
    made.add("color", compressed(stamp_ns, color, "rgb8; png compressed"), 0.0)
    depth = struct.pack("<iff", 0, 0.0, 0.0) + png
    made.add("depth", compressed(stamp_ns, depth, "16UC1; compressedDepth png"), 0.0)
    frame = made.take_frame(0.0)
    assert frame is not None, made.problem
    np.testing.assert_array_equal(frame.rgb, RGB)
    np.testing.assert_array_equal(frame.depth_mm, DEPTH)


def test_dropped_and_late_transforms_cost_frames_and_never_a_wrong_pose() -> None:
    made = robot(map_frame="odom")
    rng = np.random.default_rng(0)
    taken = 0
    waiting: list[tuple[float, bytes]] = []
    for step in range(100):
        now_s, stamp_ns = 0.05 * step, T0 + 200 * MS + step * 50 * MS
        edge = transforms(stamp_ns, ("odom", "base_link", (stamp_ns - T0) * 1e-8, 0.0))
        if rng.random() > 0.2:  # one in five is lost, the others come up to 0.3 s late
            waiting.append((now_s + float(rng.uniform(0.0, 0.3)), edge))
        for due in [each for each in waiting if each[0] <= now_s]:
            made.add("tf", due[1], now_s)
            waiting.remove(due)
        show(made, stamp_ns)
        frame = made.take_frame(now_s)
        if frame is not None:
            taken += 1
            x_m = (frame.stamp_ns - T0) * 1e-8 + 0.2
            assert frame.T_map_camera[0, 3] == pytest.approx(x_m, abs=1e-6)
    assert taken > 0
    assert made.counts.no_transform > 0


def test_pairs_are_the_nearest_within_the_tolerance_and_older_ones_are_dropped() -> None:
    pairs = PairBuffer(10)
    pairs.add("depth", 100, b"depth")
    pairs.add("color", 85, b"far")
    assert pairs.take() is None
    pairs.add("color", 108, b"near")
    pairs.add("color", 109, b"next")
    assert pairs.take() == (100, b"near", b"depth")
    assert pairs.take() is None
    for stamp in (201, 301, 401):
        pairs.add("color", stamp, b"c%d" % stamp)
        pairs.add("depth", stamp, b"d%d" % stamp)
    assert pairs.take() == (401, b"c401", b"d401")
    assert pairs.unpaired == 1 + 1 + 4
