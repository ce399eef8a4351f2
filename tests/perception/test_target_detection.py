"""The target of a search in one frame, and the picture that is sent along."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.detectors.patches import PatchDetector
from onemap_perception.detectors.protocol import Detection
from onemap_perception.target_detection import (
    MAX_POINTS,
    MAX_SIDE_PX,
    backproject_detections,
    detect_in_frame,
    encode_picture,
    iou,
    make_target,
    suppress_overlaps,
    with_picture,
)
from onemap_shared.geometry import U16, Bool, inverse, pose_2d, transform
from onemap_shared.messages import Detections, RgbdFrame
from tests.perception.toy import CAMERA, ColourEncoder, frame

ENCODER = ColourEncoder()


def test_the_target_comes_first_and_the_other_names_compete() -> None:
    target = make_target(ENCODER, "blue", ("red", "blue", "green"))
    assert target.name == "blue"
    assert target.queries is not None
    assert target.queries.texts == ("blue", "red", "green")


def detection(name: str, score: float, x: int, y: int, side: int = 4) -> Detection:
    """A square of ``side`` cells at (x, y) of a grid of 16 x 16."""
    mask = np.zeros((16, 16), bool)
    mask[y : y + side, x : x + side] = True
    return Detection(name, score, (x, y, x + side, y + side), mask)


def test_scores_of_two_networks_are_not_compared() -> None:
    chair = replace(detection("chair", 0.9, 2, 2), scale="coco")
    throne = replace(detection("throne", 0.4, 2, 2), scale="open")
    assert suppress_overlaps((chair, throne)) == (chair, throne)


@given(st.lists(st.tuples(st.sampled_from("abc"), st.floats(0, 1), st.integers(0, 12)), max_size=8))
def test_the_surest_always_stands_and_every_loser_has_a_surer_rival(
    drawn: list[tuple[str, float, int]],
) -> None:
    found = [detection(name, score, x, 3) for name, score, x in drawn]
    standing = suppress_overlaps(found)
    if found:
        assert any(max(found, key=lambda each: each.score) is each for each in standing)
    for loser in (each for each in found if not any(each is one for one in standing)):
        assert any(
            rival.name != loser.name and rival.score > loser.score
            for rival in found
            if iou(rival.mask, loser.mask) >= 0.5
        )


def masked(mask: Bool) -> Detection:
    return Detection("red", 1.0, (0.0, 0.0, 1.0, 1.0), mask)


def frame_of(depth_mm: U16) -> RgbdFrame:
    return replace(frame(), rgb=np.zeros((*depth_mm.shape, 3), np.uint8), depth_mm=depth_mm)


def test_points_lie_on_the_object_in_the_map() -> None:
    T_map_camera = pose_2d(2.0, -1.0, 0.7)
    mask = np.zeros((4, 6), bool)
    mask[1:3, 2:4] = True  # columns 16 to 32 and rows 8 to 24 of the image
    posed = replace(frame(depth_mm=1500), T_map_camera=T_map_camera)
    points, owners = backproject_detections([masked(mask)], posed)
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
    points, _ = backproject_detections([masked(np.ones((4, 6), bool))], frame_of(depth_mm))
    np.testing.assert_allclose(points[:, 2], 1.5, rtol=1e-5)


SHOWN = frame()


def decoded(picture: bytes) -> np.ndarray:
    image = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB))


def detections() -> Detections:
    detector = PatchDetector("toy")
    return detect_in_frame(
        detector, make_target(ENCODER, "red", ()), SHOWN, ENCODER.encode(SHOWN.rgb)
    )


def test_without_the_target_there_is_no_picture() -> None:
    rivals = detections()
    assert with_picture(rivals, SHOWN.rgb, "blue") is rivals
    nothing = replace(
        rivals,
        names=(),
        boxes_px=rivals.boxes_px[:0],
        scores=rivals.scores[:0],
        points_map=rivals.points_map[:0],
        point_owner=rivals.point_owner[:0],
    )
    assert with_picture(nothing, SHOWN.rgb, "red").picture == b""


@pytest.mark.parametrize("shape", [(1080, 1920, 3), (1920, 1080, 3), (640, 4000, 3), (1, 9000, 3)])
def test_a_large_frame_is_made_smaller(shape: tuple[int, int, int]) -> None:
    picture, scale = encode_picture(np.full(shape, 90, np.uint8))
    image = decoded(picture)
    assert max(image.shape) == MAX_SIDE_PX
    assert scale == pytest.approx(MAX_SIDE_PX / max(shape))
    assert image.shape[0] == max(round(shape[0] * scale), 1)
