"""Things without a name have the size asked for, stand on the floor, and are never the same."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_simulator.generation.mesh import box
from onemap_simulator.generation.model import Material, Model, Part
from onemap_tools.train.variety.strangers import BODIES, STRANGER, stranger

PARTS = (Part(box((1, 2, 3)), Material(np.zeros((64, 64, 3), np.uint8))),)


def made(seed: int, parts: tuple[Part, ...] = PARTS) -> Model:
    def material() -> Material:
        return Material(np.zeros((64, 64, 3), np.uint8))

    return stranger(np.random.default_rng(seed), (0.8, 0.3, 1.5), parts, material)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_it_has_the_size_asked_for_and_stands_on_its_base(seed: int) -> None:
    model = made(seed)
    assert model.category == STRANGER
    np.testing.assert_allclose(model.lower, (-0.4, -0.15, 0), atol=1e-6)
    np.testing.assert_allclose(model.upper, (0.4, 0.15, 1.5), atol=1e-6)
    for part in model.parts:
        assert np.isfinite(part.mesh.vertices).all()
        assert np.isfinite(part.mesh.uv).all()


def test_it_is_a_function_of_the_generator_and_needs_no_parts() -> None:
    first, again, other = (made(seed, ()) for seed in (5, 5, 6))
    np.testing.assert_array_equal(first.parts[0].mesh.vertices, again.parts[0].mesh.vertices)
    shapes = {len(model.parts) for model in (made(seed) for seed in range(12))}
    assert len(shapes) > 2
    assert (
        other.parts[0].mesh.vertices.shape != first.parts[0].mesh.vertices.shape
        or (other.parts[0].mesh.vertices != first.parts[0].mesh.vertices).any()
    )


@pytest.mark.parametrize("index", range(len(BODIES)))
def test_every_body_has_a_volume(index: int) -> None:
    mesh = BODIES[index](np.random.default_rng(0))
    assert (np.ptp(mesh.vertices, axis=0) > 0.01).all()
