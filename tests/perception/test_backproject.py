"""Points of detections: on the object, in the map frame, without the background."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_perception.detectors.protocol import Detection
from onemap_perception.target_detection import MAX_POINTS, backproject_detections
from onemap_shared.geometry import U16, Bool, inverse, pose_2d, transform
from onemap_shared.messages import RgbdFrame
from tests.perception.toy import CAMERA, frame


def detection(mask: Bool) -> Detection:
    return Detection("red", 1.0, (0.0, 0.0, 1.0, 1.0), mask)


def frame_of(depth_mm: U16) -> RgbdFrame:
    return replace(frame(), rgb=np.zeros((*depth_mm.shape, 3), np.uint8), depth_mm=depth_mm)


def test_points_lie_on_the_object_in_the_map() -> None:
    T_map_camera = pose_2d(2.0, -1.0, 0.7)
    mask = np.zeros((4, 6), bool)
    mask[1:3, 2:4] = True  # columns 16 to 32 and rows 8 to 24 of the image
    posed = replace(frame(depth_mm=1500), T_map_camera=T_map_camera)
    points, owners = backproject_detections([detection(mask)], posed)
    assert 0 < len(points) <= MAX_POINTS
    assert points.dtype == np.float32
    assert owners.tolist() == [0] * len(points)
    x, y, z = transform(inverse(T_map_camera), points.astype(np.float64)).T
    np.testing.assert_allclose(z, 1.5, rtol=1e-5)
    for at_depth_1, first, last in (
        (x / z, CAMERA.x_at(16), CAMERA.x_at(31)),
        (y / z, CAMERA.y_at(8), CAMERA.y_at(23)),
    ):
        assert at_depth_1.min() == pytest.approx(first, abs=1e-5)
        assert at_depth_1.max() == pytest.approx(last, abs=1e-5)


def test_the_background_within_a_mask_is_left_out() -> None:
    depth_mm = np.full((32, 48), 1500, np.uint16)
    depth_mm[:, 24:26] = 4000
    points, _ = backproject_detections([detection(np.ones((4, 6), bool))], frame_of(depth_mm))
    np.testing.assert_allclose(points[:, 2], 1.5, rtol=1e-5)


def test_an_object_without_depth_has_no_points() -> None:
    depth_mm = np.full((32, 48), 1500, np.uint16)
    depth_mm[:, :24] = 0
    left, right = np.zeros((4, 6), bool), np.zeros((4, 6), bool)
    left[:, :3], right[:, 3:] = True, True
    points, owners = backproject_detections([detection(left), detection(right)], frame_of(depth_mm))
    assert set(owners.tolist()) == {1}
    assert len(points) == MAX_POINTS


def test_no_detections_have_no_points() -> None:
    points, owners = backproject_detections([], frame())
    assert (points.shape, owners.shape) == ((0, 3), (0,))


@pytest.mark.parametrize("shape", [(1, 1), (3, 7), (17, 9)])
def test_a_mask_of_any_resolution_covers_the_image(shape: tuple[int, int]) -> None:
    points, _ = backproject_detections(
        [detection(np.ones(shape, bool))], frame_of(np.full((5, 11), 1000, np.uint16))
    )
    assert len(points) == 55
