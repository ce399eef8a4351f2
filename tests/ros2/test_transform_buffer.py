from __future__ import annotations

import numpy as np
import pytest

from onemap_ros2.transform_buffer import (
    KEPT_NS,
    TransformBuffer,
    TransformError,
    TransformLate,
    rigid,
)
from onemap_shared.geometry import inverse, pose_2d

MOUNT = pose_2d(0.2, 0.0, 0.0)


def tree() -> TransformBuffer:
    buffer = TransformBuffer()
    buffer.add_static("base", "camera", MOUNT)
    buffer.add("odom", "base", 0, pose_2d(0.0, 0.0, 0.0))
    buffer.add("odom", "base", 100, pose_2d(1.0, 2.0, 1.0))
    buffer.add("map", "odom", 0, pose_2d(5.0, 0.0, 0.0))
    buffer.add("map", "odom", 200, pose_2d(5.0, 0.0, 0.0))
    return buffer


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 1.0])
def test_interpolates_between_stamps_through_the_tree(share: float) -> None:
    T = tree().lookup("map", "camera", int(100 * share))
    expected = pose_2d(5.0, 0.0, 0.0) @ pose_2d(share, 2 * share, share) @ MOUNT
    np.testing.assert_allclose(T, expected, atol=1e-12)
    np.testing.assert_allclose(tree().lookup("camera", "map", int(100 * share)), inverse(expected))


def test_never_extrapolates() -> None:
    with pytest.raises(TransformLate, match="base in odom ends"):
        tree().lookup("map", "camera", 101)
    buffer = tree()
    buffer.add("odom", "base", KEPT_NS + 50, pose_2d(0.0, 0.0, 0.0))
    with pytest.raises(TransformError, match="base in odom begins") as error:
        buffer.lookup("map", "camera", 50)
    assert not isinstance(error.value, TransformLate)


def test_transforms_may_arrive_out_of_order_and_twice() -> None:
    buffer = tree()
    buffer.add("odom", "base", 50, pose_2d(9.0, 0.0, 0.0))
    buffer.add("odom", "base", 50, pose_2d(8.0, 0.0, 0.0))
    assert buffer.lookup("odom", "base", 50)[0, 3] == 8.0


def test_static_frames_hold_at_all_times_and_a_frame_is_itself() -> None:
    np.testing.assert_allclose(tree().lookup("base", "camera", -7), MOUNT)
    np.testing.assert_array_equal(tree().lookup("x", "x", 0), np.eye(4))


def test_frames_that_are_not_connected_are_named() -> None:
    with pytest.raises(TransformLate, match="'map' and 'lidar' are not connected; known are base"):
        tree().lookup("map", "lidar", 0)


def test_a_new_parent_replaces_the_old_one() -> None:
    buffer = tree()
    buffer.add("map", "base", 0, pose_2d(3.0, 0.0, 0.0))
    assert buffer.lookup("map", "base", 0)[0, 3] == 3.0


def test_a_circle_is_refused() -> None:
    buffer = TransformBuffer()
    buffer.add_static("a", "b", MOUNT)
    buffer.add_static("b", "a", MOUNT)
    with pytest.raises(TransformError, match="circle"):
        buffer.lookup("c", "a", 0)


def test_after_a_clock_jump_only_static_transforms_remain() -> None:
    buffer = tree()
    buffer.forget_motion()
    np.testing.assert_allclose(buffer.lookup("base", "camera", 0), MOUNT)
    with pytest.raises(TransformLate):
        buffer.lookup("odom", "base", 50)


def test_a_quaternion_of_length_zero_is_refused() -> None:
    with pytest.raises(ValueError, match="norm"):
        rigid((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="NaN"):
        rigid((float("nan"), 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
