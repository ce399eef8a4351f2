"""The simulated detector: rates of errors as set, and independent of the features."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_perception.detectors.protocol import Detection, Image
from onemap_perception.encoders.mini import SHIPPED
from onemap_simulator.rendering.label_renderer import label_colours
from onemap_tools.bench.navigation.simulated_detector import (
    SimulatedDetector,
    SimulatedDetectorParams,
    object_boxes,
)
from onemap_tools.bench.navigation.simulated_features import (
    SimulatedEncoder,
    SimulatedFeatureParams,
)
from tests.tools.bench.navigation.test_episodes import room

BED, DESK = 2, 3
EXACT = SimulatedDetectorParams(miss=0.0, confusion=0.0, stray=0.0)


def image() -> Image:
    labels = np.zeros((30, 40), np.int32)
    labels[5:15, 10:30] = BED
    labels[20, 20] = DESK
    return Image(label_colours(labels))


def frames(params: SimulatedDetectorParams, word: str, count: int = 300) -> list[Detection]:
    names = SimulatedEncoder(
        room(), SHIPPED, SimulatedFeatureParams(), np.random.default_rng(0)
    ).embed_text((word,))
    detector = SimulatedDetector(room(), params, seed=4)
    return [found for _ in range(count) for found in detector.detect(image(), names)]


def test_without_errors_every_large_object_is_boxed() -> None:
    (bed,) = frames(EXACT, "bed", count=1)
    assert bed.box_px == (10.0, 5.0, 30.0, 15.0)
    assert bed.mask[10, 20]
    assert frames(EXACT, "desk", count=1) == []  # one pixel
    assert frames(EXACT, "toilet", count=1) == []


def test_errors_come_as_often_as_set() -> None:
    assert len(frames(EXACT.model_copy(update={"miss": 0.3}), "bed")) / 300 == pytest.approx(
        0.7, abs=0.08
    )
    assert len(frames(EXACT.model_copy(update={"stray": 0.1}), "toilet")) / 300 == pytest.approx(
        0.1, abs=0.06
    )


def test_a_confused_object_stays_confused_but_structure_is_never() -> None:
    wrong = frames(EXACT.model_copy(update={"confusion": 1.0}), "toilet")
    assert len(wrong) / 300 == pytest.approx(0.5, abs=0.1)
    assert {detection.box_px for detection in wrong} == {(10.0, 5.0, 30.0, 15.0)}


def test_boxes_enclose_the_pixels_of_each_object() -> None:
    labels = np.array([[-1, 0, 0], [-1, 0, 2]], np.int32)
    np.testing.assert_array_equal(
        object_boxes(labels, 3), [[1, 0, 3, 2, 3], [0, 0, 0, 0, 0], [2, 1, 3, 2, 1]]
    )
