from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.furniture.seating import (
    armchair,
    bench,
    chair,
    legs,
    sofa,
    stool,
)
from tests.simulator.generation.furniture.draws import draws, extents, sampler


@pytest.mark.parametrize("seed", range(8))
def test_four_legs_reach_from_the_floor_to_the_seat(seed: int) -> None:
    meshes = legs(sampler(seed), 0.5, 0.4, 0.45)
    assert len(meshes) == 4
    for mesh in meshes:
        assert abs(mesh.vertices[:, 2].min()) < 0.02
        assert mesh.vertices[:, 2].max() == pytest.approx(0.45, abs=0.02)
    centres = np.array([mesh.vertices[:, :2].mean(axis=0) for mesh in meshes])
    assert {tuple(np.sign(centre)) for centre in centres} == {
        (a, b) for a in (-1, 1) for b in (-1, 1)
    }


def test_a_sofa_is_wider_than_an_armchair_and_both_have_a_back() -> None:
    assert extents(draws(sofa))[:, 0].min() > extents(draws(armchair))[:, 0].max()
    for model in (*draws(sofa), *draws(armchair)):
        points = np.concatenate([part.mesh.vertices for part in model.parts])
        assert points[points[:, 2].argmax(), 1] > 0


def test_a_chair_has_a_back_and_a_stool_and_a_bench_have_none() -> None:
    assert (extents(draws(chair))[:, 2] > 0.8).all()
    assert (extents(draws(stool))[:, 2] < 0.85).all()
    assert (extents(draws(bench))[:, 2] < 0.5).all()
