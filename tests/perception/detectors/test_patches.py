"""Detections from patch scores, and their points in the map."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.backproject import MAX_POINTS, DepthView, detection_points
from onemap_perception.detectors.patches import PatchDetector, PatchThresholds, box_px, components
from onemap_perception.detectors.protocol import Detection, Image
from onemap_shared.geometry import Bool, inverse, pose_2d, transform
from tests.perception.toy import CAMERA, COLOURS, ColourEncoder, frame

ENCODER = ColourEncoder()


def sample_image() -> Image:
    rgb = frame().rgb
    return Image(rgb, ENCODER.encode(rgb))


def detector(**limits: float) -> PatchDetector:
    return PatchDetector(PatchThresholds(**limits), "toy")  # type: ignore[arg-type]


def test_a_red_square_is_the_one_red_thing() -> None:
    (found,) = detector().detect(sample_image(), ENCODER.embed_text(["red"]))
    assert found.name == "red"
    assert found.score > 0.99
    assert found.box_px == (16.0, 8.0, 32.0, 24.0)
    assert found.mask.sum() == 4
    assert detector().detector_id == "patches/toy"


def test_what_is_not_there_is_not_found() -> None:
    assert detector().detect(sample_image(), ENCODER.embed_text(["blue"])) == ()


def test_several_names_come_best_first() -> None:
    found = detector().detect(sample_image(), ENCODER.embed_text(COLOURS))
    assert {detection.name for detection in found} == {"red", "green"}
    assert [detection.score for detection in found] == sorted(
        (t.score for t in found), reverse=True
    )


def test_things_smaller_or_less_sure_than_the_limits_are_left_out() -> None:
    red = ENCODER.embed_text(["red"])
    assert detector(patches=5).detect(sample_image(), red) == ()
    assert detector(core=0.99999).detect(sample_image(), red) == ()


def test_at_most_so_many_detections_of_a_name() -> None:
    rgb = np.zeros((40, 40, 3), np.uint8)
    rgb[..., 1] = 200
    rgb[::16, ::16] = (200, 0, 0)  # the toy looks at each patch's first pixel
    image = Image(rgb, ENCODER.encode(rgb))
    red = ENCODER.embed_text(["red"])
    assert len(detector(patches=1, detections=9).detect(image, red)) == 9
    assert len(detector(patches=1, detections=4).detect(image, red)) == 4


@given(bits=st.lists(st.lists(st.booleans(), min_size=6, max_size=6), min_size=4, max_size=4))
def test_components_are_the_groups_that_touch(bits: list[list[bool]]) -> None:
    wanted: Bool = np.array(bits)
    labels = components(wanted)
    assert ((labels > 0) == wanted).all()
    # The slow twin: spread the smallest number of the neighbourhood until nothing changes.
    slow = np.where(wanted, np.arange(wanted.size).reshape(wanted.shape) + 1, 0)
    for _ in range(wanted.size):
        for i, j in np.argwhere(wanted):
            near = slow[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2]
            slow[i, j] = near[near > 0].min()
    pairs = {(int(a), int(b)) for a, b in zip(labels[wanted], slow[wanted], strict=True)}
    assert len(pairs) == len({a for a, _ in pairs}) == len({b for _, b in pairs})


def test_a_box_of_an_image_that_was_resized() -> None:
    mask = np.zeros((4, 5), bool)
    mask[1:3, 4] = True
    assert box_px(mask, (100, 80)) == (80.0, 20.0, 100.0, 60.0)


def found_at(mask: Bool) -> Detection:
    return Detection("red", 1.0, (0.0, 0.0, 1.0, 1.0), mask)


def test_points_lie_on_the_thing_in_the_map() -> None:
    image = frame(depth_mm=1500)
    (detection,) = detector().detect(sample_image(), ENCODER.embed_text(["red"]))
    T_map_camera = pose_2d(2.0, -1.0, 0.7)
    view = DepthView(image.depth_mm, CAMERA, T_map_camera)
    points, owners = detection_points([detection], view)
    assert 0 < len(points) <= MAX_POINTS
    assert points.dtype == np.float32
    assert owners.tolist() == [0] * len(points)
    camera = transform(inverse(T_map_camera), points.astype(np.float64))
    np.testing.assert_allclose(camera[:, 2], 1.5, rtol=1e-5)
    u = camera[:, 0] / camera[:, 2] * CAMERA.fx + CAMERA.cx
    v = camera[:, 1] / camera[:, 2] * CAMERA.fy + CAMERA.cy
    assert (u > 16).all()
    assert (u < 32).all()
    assert (v > 8).all()
    assert (v < 24).all()


def test_the_wall_behind_is_no_part_of_the_thing() -> None:
    depth_mm = np.full((32, 48), 1500, np.uint16)
    depth_mm[:, 24:26] = 4000
    mask = np.ones((4, 6), bool)
    points, _ = detection_points([found_at(mask)], DepthView(depth_mm, CAMERA, np.eye(4)))
    np.testing.assert_allclose(points[:, 2], 1.5, rtol=1e-5)


def test_things_without_depth_have_no_points() -> None:
    depth_mm = np.full((32, 48), 1500, np.uint16)
    depth_mm[:, :24] = 0
    left, right = np.zeros((4, 6), bool), np.zeros((4, 6), bool)
    left[:, :3], right[:, 3:] = True, True
    view = DepthView(depth_mm, CAMERA, np.eye(4))
    points, owners = detection_points([found_at(left), found_at(right)], view)
    assert set(owners.tolist()) == {1}
    assert len(points) == MAX_POINTS
    empty, none = detection_points([], view)
    assert empty.shape == (0, 3)
    assert none.shape == (0,)


@pytest.mark.parametrize("shape", [(1, 1), (3, 7), (17, 9)])
def test_any_mask_size_covers_the_image(shape: tuple[int, int]) -> None:
    view = DepthView(np.full((5, 11), 1000, np.uint16), CAMERA, np.eye(4))
    points, _ = detection_points([found_at(np.ones(shape, bool))], view)
    assert len(points) == 55
