"""Boxes to detections: clipping, thresholds, and the pixels they stand for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.detectors.boxes import Box, detections_from_boxes, inner_mask
from onemap_perception.detectors.protocol import Detection
from tests.perception.detectors.samples import inside

SQUARE = (0.0, 0.0, 9.0, 9.0)


def accepted(
    boxes: Sequence[Box], *, score_threshold: float = 0.3, max_detections: int = 16
) -> tuple[Detection, ...]:
    return detections_from_boxes(
        boxes, (9, 9), score_threshold=score_threshold, max_detections=max_detections
    )


def test_the_middle_of_a_box_stands_for_the_object() -> None:
    mask = inner_mask((10, 20, 20, 40), (64, 48))
    rows, columns = np.nonzero(mask)
    assert (columns.min(), columns.max() + 1) == (12, 18)
    assert (rows.min(), rows.max() + 1) == (24, 36)


@given(
    corners=st.tuples(*[st.floats(-50, 150) | st.sampled_from([np.nan, np.inf, -np.inf])] * 4),
    image_px=st.tuples(st.integers(1, 80), st.integers(1, 80)),
)
def test_any_box_is_clipped_or_left_out(
    corners: tuple[float, float, float, float], image_px: tuple[int, int]
) -> None:
    detections = detections_from_boxes(
        [Box("x", 0.5, corners)], image_px, score_threshold=0.3, max_detections=6
    )
    assert inside(detections, image_px)


def test_a_box_within_the_image_is_a_detection() -> None:
    (detection,) = accepted([Box("x", 0.5, (1, 2, 8, 9))])
    assert (detection.name, detection.score, detection.box_px) == ("x", 0.5, (1, 2, 8, 9))


def test_boxes_below_the_threshold_do_not_count_and_the_best_come_first() -> None:
    boxes = [Box("x", score, SQUARE) for score in (0.3, 0.9, 0.6)]
    assert [each.score for each in accepted(boxes, score_threshold=0.5)] == [0.9, 0.6]
    assert len(accepted(boxes, max_detections=1)) == 1


def test_many_boxes_of_one_name_do_not_displace_another() -> None:
    boxes = [Box("chair", 0.9, SQUARE)] * 20 + [Box("cup", 0.4, SQUARE)]
    found = accepted(boxes, max_detections=3)
    assert [each.name for each in found] == ["chair"] * 3 + ["cup"]


def test_scores_above_one_are_one() -> None:
    (detection,) = accepted([Box("x", 1.5, SQUARE)])
    assert detection.score == 1.0
