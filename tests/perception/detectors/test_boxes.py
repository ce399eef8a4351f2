"""Boxes to detections: clipping, thresholds, and the pixels they stand for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.config import CocoParams
from onemap_perception.detectors.boxes import (
    Box,
    BoxDetector,
    RoutedDetector,
    detections_from_boxes,
    inner_mask,
)
from onemap_perception.detectors.protocol import Detection, Image
from onemap_perception.encoders.checkpoint import load_pretrained
from onemap_perception.errors import BackendError
from onemap_shared.geometry import U8
from onemap_shared.messages import TextEmbeddings
from tests.perception.detectors.samples import inside, names, noise

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


def test_boxes_below_the_threshold_do_not_count_and_the_best_come_first() -> None:
    boxes = [Box("x", score, SQUARE) for score in (0.3, 0.9, 0.6)]
    assert [each.score for each in accepted(boxes, score_threshold=0.5)] == [0.9, 0.6]
    assert len(accepted(boxes, max_detections=1)) == 1


def test_many_boxes_of_one_name_do_not_displace_another() -> None:
    boxes = [Box("chair", 0.9, SQUARE)] * 20 + [Box("cup", 0.4, SQUARE)]
    found = accepted(boxes, max_detections=3)
    assert [each.name for each in found] == ["chair"] * 3 + ["cup"]


class FixedBoxes:
    """Implements ``BoxNetwork``: the same three boxes for every name but unicorns."""

    network_id = "fixed-1"

    def __init__(self) -> None:
        self.asked: list[tuple[tuple[str, ...], float]] = []

    def supports(self, name: str) -> bool:
        return name != "unicorn"

    def boxes(self, rgb: U8, names: Sequence[str], score_threshold: float) -> list[Box]:
        self.asked.append((tuple(names), score_threshold))
        scores = (0.9, 0.7, 0.2)
        return [Box(name, score, (0, 0, 8, 8)) for name in names for score in scores]


def test_the_network_is_asked_for_the_names_it_supports() -> None:
    network = FixedBoxes()
    detector = BoxDetector(network, CocoParams(score_threshold=0.4))
    found = detector.detect(noise(), names("sofa", "unicorn"))
    assert network.asked == [(("sofa",), 0.4)]
    assert [(each.name, each.score) for each in found] == [("sofa", 0.9), ("sofa", 0.7)]
    assert detector.detector_id == "fixed-1"
    assert not detector.reads_features


class Unwhole:
    """A model class of transformers whose checkpoint lacks two tensors."""

    @staticmethod
    def from_pretrained(folder: Path, **options: bool) -> tuple[None, dict[str, set[str]]]:
        return None, {"missing_keys": {"head.weight", "body.bias"}}


def test_a_checkpoint_that_lacks_a_tensor_is_refused_by_its_name(tmp_path: Path) -> None:
    with pytest.raises(BackendError, match=r"another architecture: it lacks body\.bias"):
        load_pretrained(Unwhole, tmp_path, what="model")


class OneEach:
    """One detection of every name, with a fixed score."""

    reads_features = False

    def __init__(self, detector_id: str, score: float, supported: tuple[str, ...] = ()) -> None:
        self.detector_id = detector_id
        self.asked: list[tuple[str, ...]] = []
        self._score, self._supported = score, supported

    def supports(self, name: str) -> bool:
        return name in self._supported

    def detect(self, image: Image, wanted: TextEmbeddings) -> tuple[Detection, ...]:
        self.asked.append(wanted.texts)
        mask = np.ones((1, 1), bool)
        return tuple(Detection(name, self._score, (0, 0, 1, 1), mask) for name in wanted.texts)


def test_each_name_goes_to_one_detector_and_the_best_come_first() -> None:
    closed, open_vocabulary = OneEach("closed", 0.5, ("tv", "cup")), OneEach("open", 0.8)
    routed = RoutedDetector(closed, open_vocabulary)
    found = routed.detect(noise(), names("tv", "unicorn", "cup"))
    assert (closed.asked, open_vocabulary.asked) == ([("tv", "cup")], [("unicorn",)])
    assert [each.name for each in found] == ["unicorn", "tv", "cup"]
    assert [each.scale for each in found] == ["open", "closed", "closed"]
    assert routed.detector_id == "closed+open"
