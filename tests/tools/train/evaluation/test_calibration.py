"""The temperature is found again in data that was drawn with it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_tools.train.data.frame_dataset import FrameDataset
from onemap_tools.train.evaluation.calibration import (
    TEMPERATURES,
    fit_temperature,
    most_likely_temperature,
)
from tests.tools.train.tiny import VOCABULARY, PerfectEncoder


@given(factor=st.floats(6, 70))
@settings(max_examples=10, deadline=None)
def test_the_temperature_is_found_again(factor: float) -> None:
    rng = np.random.default_rng(0)
    cosines = rng.uniform(-0.3, 0.9, (4000, 5)).astype(np.float32)
    shares = np.exp(factor * cosines)
    shares /= shares.sum(axis=1, keepdims=True)
    # All five are classes; then the last two are neutral words, right where there is no name.
    none = np.zeros((4000, 1))
    named = np.concatenate([shares, none], axis=1)
    nameless = np.concatenate([shares[:, :3], shares[:, 3:].sum(axis=1, keepdims=True)], axis=1)
    for known in (named, nameless):
        temperature = most_likely_temperature(cosines, known.astype(np.float32))
        assert temperature == pytest.approx(factor, rel=0.06)


def test_a_perfect_encoder_gets_a_high_temperature_and_a_wrong_one_the_lowest() -> None:
    encoder = PerfectEncoder()
    names = encoder.embed_text(VOCABULARY.names)
    label = np.zeros((2, 64, 96), np.uint8)
    label[:, 16:48, 16:80] = 1  # edges between patches of 8 x 8
    bright = np.repeat((200 * label)[..., None], 3, axis=-1)
    for rgb, low, high in ((bright, 30, 80), (255 - bright, 0, TEMPERATURES[0])):
        frames = FrameDataset(rgb, label, VOCABULARY.names)
        temperature = fit_temperature(encoder, names, frames, np.random.default_rng(0))
        assert low < temperature <= high
