"""Evaluation and temperature, of an encoder that is right and of one that is wrong."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_tools.train import evaluation
from onemap_tools.train.frames import FrameDataset
from tests.tools.train.tiny import VOCABULARY, PerfectEncoder, frames_of


def sofa_frames() -> FrameDataset:
    """Two frames: one with a sofa in the middle, one of a wall alone."""
    label = np.zeros((2, 48, 64), np.uint8)
    label[0, 16:32, 16:48] = 1
    rgb = np.repeat(np.where(label == 1, 200, 20).astype(np.uint8)[..., None], 3, axis=-1)
    return frames_of(rgb, label)


def figures(encoder: PerfectEncoder) -> Any:
    """Of the two frames."""
    return evaluation.evaluate(encoder, VOCABULARY, sofa_frames(), lambda _: None)


def test_a_perfect_encoder_has_perfect_figures() -> None:
    part = figures(PerfectEncoder())
    assert part["names_r_precision"] == part["held_out_aliases_r_precision"] == 1
    assert part["pixel_accuracy"] == pytest.approx(1, abs=0.03)  # edges run through patches
    assert part["miou"] > 0.9
    assert part["frames"] == 2
    values = list(part["iou_by_class"].values())
    assert values == sorted(values)


@given(factor=st.floats(6, 70))
@settings(max_examples=10, deadline=None)
def test_the_temperature_is_found_again(factor: float) -> None:
    rng = np.random.default_rng(0)
    cosines = rng.uniform(-0.3, 0.9, (4000, 5)).astype(np.float32)
    shares = np.exp(factor * cosines)
    shares /= shares.sum(axis=1, keepdims=True)
    temperature = evaluation.most_likely_temperature(cosines, shares.astype(np.float32))
    assert temperature == pytest.approx(factor, rel=0.06)
