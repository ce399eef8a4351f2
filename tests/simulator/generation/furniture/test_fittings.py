from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.floor_plan import DOOR_HEIGHT_M
from onemap_simulator.generation.furniture.fittings import curtain, door, rug, window
from tests.simulator.generation.furniture.draws import sampler

WIDTH_M = 1.0


@pytest.mark.parametrize("leaf", [None, ("left", 90.0), ("right", 90.0), ("left", 180.0)])
def test_a_door_that_is_open_or_has_no_leaf_leaves_its_opening_clear(
    leaf: tuple[str, float] | None,
) -> None:
    for seed in range(5):
        model = door(sampler(seed), WIDTH_M, leaf)
        points = np.concatenate([part.mesh.vertices for part in model.parts])
        in_opening = (np.abs(points[:, 0]) < WIDTH_M / 2 - 0.02) & (np.abs(points[:, 1]) < 0.05)
        assert not (in_opening & (points[:, 2] < DOOR_HEIGHT_M - 0.02)).any()


def test_a_closed_door_fills_its_opening() -> None:
    leaf = door(sampler(0), WIDTH_M, ("left", 0.0)).parts[3].mesh
    assert leaf.vertices[:, 0].max() - leaf.vertices[:, 0].min() > WIDTH_M - 0.02


def test_the_hinge_decides_the_side_of_an_open_leaf() -> None:
    left = door(sampler(0), WIDTH_M, ("left", 90.0)).parts[3].mesh.vertices[:, 0].mean()
    right = door(sampler(0), WIDTH_M, ("right", 90.0)).parts[3].mesh.vertices[:, 0].mean()
    assert left == pytest.approx(-right)
    assert left < -0.4 * WIDTH_M


def test_a_window_fills_its_opening() -> None:
    for seed in range(5):
        frame = window(sampler(seed), 1.2, 1.1)
        points = np.concatenate([part.mesh.vertices for part in frame.parts])
        above_sill = points[points[:, 2] > 0]
        np.testing.assert_allclose(np.ptp(above_sill[:, 0]), 1.2, atol=0.021)  # a bar at its edge
        np.testing.assert_allclose(above_sill[:, 2].max(), 1.1, atol=1e-9)


def test_a_curtain_hangs_from_its_rod_to_its_hem_and_a_rug_is_flat() -> None:
    for seed in range(5):
        cloth = curtain(sampler(seed), 0.5, 2.0)
        assert cloth.lower[2] == pytest.approx(0.0)
        assert 2.0 < cloth.upper[2] < 2.1
        carpet = rug(sampler(seed), 1.6, 1.0)
        assert carpet.upper[2] < 0.02
