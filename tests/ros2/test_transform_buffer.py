from __future__ import annotations

import numpy as np
import pytest

from onemap_ros2.transform_buffer import KEPT_NS, TransformBuffer, TransformError, TransformLate
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


def test_a_loop_of_static_transforms_is_named() -> None:
    buffer = TransformBuffer()
    buffer.add_static("a", "b", MOUNT)
    buffer.add_static("b", "a", MOUNT)
    with pytest.raises(TransformError, match=r"loop, 'a' in 'b' in 'a': .*restart this adapter"):
        buffer.lookup("c", "a", 0)
    buffer.add_static("map", "a", MOUNT)
    np.testing.assert_allclose(buffer.lookup("map", "b", 0), MOUNT @ MOUNT)
