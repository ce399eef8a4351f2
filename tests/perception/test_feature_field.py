"""The observation variance against its slow twin, what must hold for any depth, and colours."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_perception.feature_field import (
    VarianceFormula,
    VarianceParams,
    feature_field,
    observation_variance,
)
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32
from tests.perception.toy import ColourEncoder, frame
from tests.reference import variance as slow

CAMERA = Intrinsics(30.0, 28.0, 16.0, 12.0)
FORMULAS = list(VarianceFormula)


def noisy_depth(seed: int, height: int = 24, width: int = 32) -> F32:
    """Two planes with a step, noise and holes."""
    rng = np.random.default_rng(seed)
    depth = np.where(np.arange(width) < rng.integers(0, width), 1.0, 3.0)[None, :]
    depth = depth + rng.normal(0, 0.02, (height, width))
    depth[rng.random((height, width)) < 0.1] = 0
    depth[: height // 3, : width // 2] = 0  # a hole wider than the window
    return depth.astype(np.float32)


@pytest.mark.parametrize("formula", FORMULAS)
@given(seed=st.integers(0, 2**16))
@settings(max_examples=8, deadline=None)
def test_agrees_with_the_slow_twin(formula: VarianceFormula, seed: int) -> None:
    params = VarianceParams(formula=formula)
    depth = noisy_depth(seed)
    fast = observation_variance(depth, CAMERA, params)
    np.testing.assert_allclose(fast, slow.variance(depth, CAMERA, params), rtol=1e-4)


@pytest.mark.parametrize("formula", FORMULAS)
@given(seed=st.integers(0, 2**16), height=st.integers(1, 20), width=st.integers(1, 20))
@settings(max_examples=20, deadline=None)
def test_is_positive_and_infinite_exactly_without_depth(
    formula: VarianceFormula, seed: int, height: int, width: int
) -> None:
    depth = noisy_depth(seed, height, width)
    variance = observation_variance(depth, CAMERA, VarianceParams(formula=formula))
    assert variance.shape == depth.shape
    assert variance.dtype == np.float32
    assert (variance > 0).all()
    assert (np.isinf(variance) == (depth == 0)).all()


def test_released_does_not_depend_on_the_resolution() -> None:
    step = np.repeat(np.linspace(1, 3, 32, dtype=np.float32)[None, :], 32, 0)
    fine = np.repeat(np.linspace(1, 3, 64, dtype=np.float32)[None, :], 64, 0)
    params = VarianceParams()
    coarse_camera = Intrinsics(32.0, 32.0, 16.0, 16.0)
    coarse = observation_variance(step, coarse_camera, params)
    doubled = observation_variance(fine, coarse_camera.scaled(2, 2), params)
    # Same scene, twice the pixels: away from the border the confidence agrees.
    np.testing.assert_allclose(doubled[20:44:2, 24:40:2], coarse[10:22, 12:20], rtol=0.05)


def test_depth_that_is_not_a_number_is_no_depth() -> None:
    depth = np.full((8, 8), 2.0, np.float32)
    depth[0, 0], depth[1, 1], depth[2, 2] = np.nan, np.inf, -1.0
    variance = observation_variance(depth, CAMERA, VarianceParams())
    assert np.isinf(np.diag(variance)[:3]).all()
    assert np.isfinite(variance[4:, 4:]).all()


def test_a_dark_frame_has_no_colours() -> None:
    lit, encoder = frame(), ColourEncoder()
    for share, told in ((1.0, True), (0.08, False)):
        seen = frame(rgb=(lit.rgb * share).astype(np.uint8))
        field = feature_field(seen, encoder.encode(seen.rgb), encoder, VarianceParams())
        assert field.colours.any() == told
