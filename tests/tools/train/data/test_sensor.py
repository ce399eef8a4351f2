"""What a camera adds: size and kind stay, repeatable, and of the strength that is meant."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_shared.geometry import F32
from onemap_tools.train.data.sensor import hue_rotation, jittered_colour, with_sensor_effects

GREY = np.full((48, 64, 3), 120, np.float32)
Effect = Callable[[F32, np.random.Generator], F32]


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
@pytest.mark.parametrize("effect", [jittered_colour, with_sensor_effects])
def test_an_effect_keeps_the_picture_s_size(effect: Effect, seed: int) -> None:
    before = GREY.copy()
    image = effect(GREY, np.random.default_rng(seed))
    assert image.shape == GREY.shape
    assert image.dtype == np.float32
    assert np.isfinite(image).all()
    np.testing.assert_array_equal(GREY, before)
    np.testing.assert_array_equal(image, effect(GREY, np.random.default_rng(seed)))


def test_sensor_effects_neither_brighten_nor_darken_a_picture() -> None:
    levels = [with_sensor_effects(GREY, np.random.default_rng(i)).mean() for i in range(200)]
    assert np.mean(levels) == pytest.approx(120, abs=2)
    spread = [with_sensor_effects(GREY, np.random.default_rng(i)).std() for i in range(200)]
    assert np.mean(np.array(spread) > 3) > 0.3  # noise
    assert np.mean(np.array(spread) < 1) > 0.3  # and often none


def test_colours_change_in_every_way() -> None:
    means = np.array(
        [jittered_colour(GREY, np.random.default_rng(i)).mean(axis=(0, 1)) for i in range(200)]
    )
    assert means.mean(axis=1).std() > 15  # exposure
    assert (means / means.mean(axis=1, keepdims=True)).std() > 0.05  # white balance


def test_a_full_turn_of_the_hue_is_none_and_grey_stays_grey() -> None:
    np.testing.assert_allclose(hue_rotation(2 * np.pi), np.eye(3), atol=1e-12)
    np.testing.assert_allclose(hue_rotation(1.0) @ np.ones(3), np.ones(3))
    third = hue_rotation(2 * np.pi / 3)
    np.testing.assert_allclose(np.sort(third @ [1, 0, 0]), [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(third @ third @ third, np.eye(3), atol=1e-12)
