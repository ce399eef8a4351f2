"""Submaps: what of them is in the map after a correction."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.submaps import (
    NO_CORRECTION,
    PlanarCorrection,
    Submap,
    moved_cells,
    submap_of,
)
from onemap_mapper.frame.update import compute_update
from onemap_shared.grid import GridSpec
from tests.mapper import scenes

SIZE_M = 0.1
SQUARE = np.argwhere(np.ones((20, 30), bool)) - (4, 11)
CENTRES = GridSpec(SIZE_M, (0, 0), (1, 1)).centres(SQUARE)


def seen() -> tuple[BeliefMap, Submap]:
    """A map of one frame, and its submap."""
    belief = BeliefMap(scenes.params())
    field = scenes.field(0, scenes.pose())
    belief.fuse(compute_update(field, belief.params))
    centre_m = field.T_map_camera[:2, 3]
    return belief, submap_of(belief, field.stamp_ns, centre_m, torch.float16)


def test_whole_cells_move_exactly() -> None:
    cells, source = moved_cells(SQUARE, PlanarCorrection(0.0, 0.3, -0.2), SIZE_M)
    np.testing.assert_array_equal(cells, SQUARE[source] + (3, -2))
    assert len(np.unique(source)) == len(SQUARE)


@pytest.mark.parametrize("yaw_rad", [-0.4, 0.02, 1.0, np.pi])
def test_a_turned_square_has_no_holes_and_no_doubles(yaw_rad: float) -> None:
    correction = PlanarCorrection(yaw_rad, 0.37, -1.21)
    cells, source = moved_cells(SQUARE, correction, SIZE_M)
    assert len(np.unique(cells, axis=0)) == len(cells)
    assert len(cells) == pytest.approx(len(SQUARE), rel=0.04)  # its area stays
    off_m = (cells + 0.5) * SIZE_M - correction.apply(CENTRES[source])
    assert np.linalg.norm(off_m, axis=1).max() <= SIZE_M / np.sqrt(2) + 1e-9
    filled = np.zeros(np.ptp(cells, axis=0) + 1, bool)
    filled[tuple((cells - cells.min(axis=0)).T)] = True
    for row in filled:
        inside = np.flatnonzero(row)
        assert row[inside[0] : inside[-1] + 1].all()  # a convex shape: each row is one run


def test_the_displacement_is_that_of_the_farthest_corner() -> None:
    _, submap = seen()
    assert submap.displacement_m(NO_CORRECTION, SIZE_M) == 0.0
    assert submap.displacement_m(PlanarCorrection(0.0, 0.3, 0.4), SIZE_M) == pytest.approx(0.5)
    turned = PlanarCorrection(0.1, 0.0, 0.0)
    assert 0.2 < submap.displacement_m(turned, SIZE_M) < 0.6  # 3 m away, 0.1 rad
    assert submap.corrected(turned).displacement_m(turned, SIZE_M) == 0.0


def test_features_and_evidence_move_together() -> None:
    _, submap = seen()
    moved = submap.corrected(PlanarCorrection(0.0, 1.0, 0.0))
    expected = moved.features.cells + (10, 0)
    cells = moved.moved_features(SIZE_M).cells
    np.testing.assert_array_equal(np.unique(cells, axis=0), np.unique(expected, axis=0))
    assert len(moved.moved_occupancy(SIZE_M).cells) == len(submap.occupancy.cells)
    assert not submap.without_searched().features.searched.any()
