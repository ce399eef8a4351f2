"""The value map of VLFM: who is in view, how frames are weighted, and what the planner gets."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_shared.grid import GridSpec
from onemap_shared.messages import FeatureField, SearchView, TextEmbeddings
from onemap_tools.bench.navigation.value_map import (
    ConfidenceValueMap,
    image_score,
    view_confidence,
)

QUERY = TextEmbeddings(
    "e",
    "s",
    ("bed",),
    np.array([[1.0, 0.0]], np.float32),
    np.zeros((0, 2), np.float32),
    np.zeros((1, 0), np.uint8),
    1.0,
)


def field(feature: tuple[float, float], yaw_rad: float = 0.0, depth_mm: int = 4000) -> FeatureField:
    """A level camera at (0, 0) that sees a wall everywhere."""
    return FeatureField(
        sequence=1,
        stamp_ns=1,
        encoder_id="e",
        text_space="s",
        features=np.full((3, 4, 2), feature, np.float16),
        variance=np.ones((30, 40), np.float32),
        depth_mm=np.full((30, 40), depth_mm, np.uint16),
        intrinsics=Intrinsics.from_fov(40, 30, np.pi / 2),
        T_map_camera=pose_2d(0.0, 0.0, yaw_rad) @ camera_mount(0.0, 1.0, 0.0),
    )


def similarity(values: ConfidenceValueMap) -> np.ndarray:
    """(2, 3): x = 2.05 and -1.95, y = -2.95, 0.05, 3.05 m."""
    grid = GridSpec(0.1, (-60, -60), (120, 120))
    zeros = np.zeros(grid.shape, np.uint8)
    view = values.view(SearchView("bed", 1, 1, 1, grid, zeros, zeros, zeros.astype(np.float32)))
    assert view.rival.size == 0
    places = np.array([[(x, y) for y in (-2.95, 0.05, 3.05)] for x in (2.05, -1.95)])
    cells = grid.cells(places)
    found: np.ndarray = view.similarity[cells[..., 0], cells[..., 1]]
    return found


def test_the_score_is_that_of_the_whole_image() -> None:
    assert image_score(field((1.0, 0.0)), QUERY) == pytest.approx(1.0)
    assert image_score(field((0.0, 2.0)), QUERY) == pytest.approx(0.5)


def test_confidence_falls_to_the_edge_of_the_image_and_ends_at_walls() -> None:
    places = np.array([[2.0, 0.0], [2.0, 1.0], [2.0, -1.0], [2.0, 2.2], [-2.0, 0.0], [5.0, 0.0]])
    ahead, left, right, beside, behind, beyond = view_confidence(places, field((1.0, 0.0)))
    assert ahead == pytest.approx(1.0)
    assert 0 < left < ahead
    assert left == pytest.approx(right)
    assert (beside, behind, beyond) == (0.0, 0.0, 0.0)


def test_frames_are_averaged_by_confidence_and_forgotten() -> None:
    values = ConfidenceValueMap(0.1)
    assert np.isnan(similarity(values)).all()
    values.add(field((1.0, 0.0)), QUERY)
    values.add(field((0.0, 1.0)), QUERY)
    seen = similarity(values)
    assert seen[0, 1] == pytest.approx(0.75, abs=0.01)
    assert np.isnan(np.delete(seen, 1)).all()
    values.add(field((1.0, 0.0), yaw_rad=np.pi), QUERY)
    assert similarity(values)[1, 1] == pytest.approx(1.0, abs=0.01)
    values.clear()
    assert np.isnan(similarity(values)).all()
