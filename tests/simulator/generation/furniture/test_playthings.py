from __future__ import annotations

import numpy as np

from onemap_simulator.generation.furniture.playthings import ball, bicycle, guitar, teddy_bear
from tests.simulator.generation.furniture.draws import draws, extents


def test_a_ball_is_round_and_lies_on_the_floor() -> None:
    size = extents(draws(ball))
    assert (np.ptp(size, axis=1) < 0.1 * size.max(axis=1)).all()
    assert all(abs(model.lower[2]) < 0.005 for model in draws(ball))


def test_a_bicycle_runs_along_x_on_two_wheels_of_one_size() -> None:
    for model in draws(bicycle):
        width, depth, height = model.upper - model.lower
        assert width > 2 * depth
        assert height < 1.2
        assert model.lower[2] < 0.001


def test_a_guitar_stands_upright_and_a_bear_sits() -> None:
    guitars, bears = extents(draws(guitar)), extents(draws(teddy_bear))
    assert (guitars[:, 2] > 2 * guitars[:, :2].max(axis=1)).all()
    assert (bears[:, 2] < 0.5).all()
