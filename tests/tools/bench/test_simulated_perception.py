"""The simulated encoder and detector: right without errors, wrong as often as set."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_perception.config import SHIPPED
from onemap_perception.detectors.protocol import Detection, Image
from onemap_perception.text.embeddings import scores
from onemap_simulator.rendering.label_renderer import label_colours
from onemap_tools.bench.navigation.simulated_perception import (
    SimulatedDetector,
    SimulatedDetectorParams,
    SimulatedEncoder,
    SimulatedFeatureParams,
)
from tests.tools.bench.test_navigation import room

EXACT = SimulatedFeatureParams(noise=0.0, object_noise=0.0, confusion=0.0, blur_patches=0.0)
BED, DESK = 2, 3  # objects of the room
LABELS = np.repeat(np.array([[BED, DESK, -1]], np.int32), 8, axis=0).repeat(8, axis=1)


def encoder(params: SimulatedFeatureParams, seed: int = 1) -> SimulatedEncoder:
    return SimulatedEncoder(room(), SHIPPED, params, np.random.default_rng(seed))


def score(simulated: SimulatedEncoder, word: str) -> np.ndarray:
    """(h, w) scores of the patches of ``LABELS``."""
    features = simulated.encode(label_colours(LABELS)).astype(np.float32)
    flat = scores(features.reshape(-1, features.shape[-1]), simulated.embed_text((word,)))
    return flat.reshape(features.shape[:2])


def test_with_errors_most_patches_still_are_and_a_seed_repeats_them() -> None:
    beds = score(encoder(SimulatedFeatureParams(confusion=0.0)), "bed")
    assert beds[:, 0].mean() > 0.3 > beds[:, 3].mean()
    same, other = (
        score(encoder(SimulatedFeatureParams(confusion=0.0), seed), "bed") for seed in (1, 2)
    )
    np.testing.assert_array_equal(beds, same)
    assert not np.array_equal(beds, other)
    confused = encoder(replace(EXACT, confusion=1.0))  # it looks like another of the scene
    assert score(confused, "bed")[:, :2].max() < 0.5


RIGHT = SimulatedDetectorParams(miss=0.0, confusion=0.0, stray=0.0)


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


def test_errors_come_as_often_as_set_and_structure_is_never_confused() -> None:
    assert len(frames(replace(RIGHT, miss=0.3), "bed")) / 300 == pytest.approx(0.7, abs=0.08)
    assert len(frames(replace(RIGHT, stray=0.1), "toilet")) / 300 == pytest.approx(0.1, abs=0.06)
    wrong = frames(replace(RIGHT, confusion=1.0), "toilet")
    assert len(wrong) / 300 == pytest.approx(0.5, abs=0.1)
    assert {detection.box_px for detection in wrong} == {(10.0, 5.0, 30.0, 15.0)}
