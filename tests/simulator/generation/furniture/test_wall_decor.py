from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.furniture.wall_decor import clock, frame, mirror, painting, picture
from onemap_simulator.generation.sampler import ModelFactory
from tests.simulator.generation.furniture.draws import backs, draws, extents


@pytest.mark.parametrize("factory", [clock, mirror, picture])
def test_it_hangs_flat_with_its_back_in_the_plane_of_the_wall(factory: ModelFactory) -> None:
    np.testing.assert_allclose(backs(draws(factory)), 0.0, atol=1e-9)
    assert (extents(draws(factory))[:, 1] < 0.07).all()


def test_a_frame_surrounds_its_rectangle() -> None:
    points = np.concatenate([mesh.vertices for mesh in frame(0.8, 0.6, 0.05, 0.03)])
    np.testing.assert_allclose(points.min(axis=0), (-0.4, -0.03, 0.0))
    np.testing.assert_allclose(points.max(axis=0), (0.4, 0.0, 0.6))
    inside = (np.abs(points[:, 0]) < 0.34) & (points[:, 2] > 0.06) & (points[:, 2] < 0.54)
    assert not inside.any()


def test_paintings_have_several_colours_and_differ() -> None:
    images = [painting(np.random.default_rng(seed)) for seed in range(6)]
    assert all(image.shape == (96, 96, 3) for image in images)
    assert all(image.reshape(-1, 3).std(axis=0).max() > 10 for image in images)
    assert len({image.tobytes() for image in images}) == len(images)
