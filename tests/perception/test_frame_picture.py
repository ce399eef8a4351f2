"""The picture sent along with detections."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from onemap_perception.detectors.patches import PatchDetector
from onemap_perception.target_detection import (
    MAX_SIDE_PX,
    detect_in_frame,
    encode_picture,
    make_target,
    with_picture,
)
from onemap_shared.messages import Detections
from tests.perception.toy import ColourEncoder, frame

ENCODER = ColourEncoder()
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
