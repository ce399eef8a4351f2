"""Regions against a flood fill, and what their numbers mean."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from onemap_mapper.query.regions import Regions, find_regions, outline
from onemap_mapper.query.similarity import TOP_CELLS
from onemap_shared.geometry import F32, I64
from onemap_shared.grid import GridSpec

GRID = GridSpec(0.1, (-4, 7), (9, 8))


def found(scores: F32, limit: float, max_regions: int = 100) -> Regions:
    variances = np.full(scores.shape, 0.25, np.float32)
    return find_regions(scores, variances, GRID, limit=limit, max_regions=max_regions)


def flooded(scores: F32, limit: float) -> list[set[tuple[int, int]]]:
    """Clusters of cells with score >= limit, touching by side or corner."""
    left = {(int(x), int(y)) for x, y in np.argwhere(np.nan_to_num(scores, nan=-1) >= limit)}
    clusters = []
    while left:
        cluster, border = set(), [left.pop()]
        while border:
            x, y = border.pop()
            cluster.add((x, y))
            near = {(x + i, y + j) for i in (-1, 0, 1) for j in (-1, 0, 1)} & left
            left -= near
            border += near
        clusters.append(cluster)
    return clusters


@given(seed=st.integers(0, 2**16))
@settings(max_examples=25, deadline=None)
def test_agrees_with_the_flood_fill(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scores = rng.uniform(0, 1, GRID.shape).astype(np.float32)
    scores[rng.random(GRID.shape) < 0.2] = np.nan
    regions = found(scores, 0.7)
    assert (np.diff(regions.scores) <= 1e-6).all()
    expected = []
    for cluster in flooded(scores, 0.7):
        cells = np.array(sorted(cluster))
        values = scores[tuple(cells.T)].astype(np.float64)
        centres = GRID.centres(cells)
        expected.append(
            (
                np.mean(np.sort(values)[::-1][:TOP_CELLS]),
                *np.average(centres, axis=0, weights=values),
                *(centres.min(axis=0) - 0.05),
                *(centres.max(axis=0) + 0.05),
            )
        )
    have = np.column_stack([regions.scores, regions.centres_m, regions.extents_m])
    assert have.shape == (len(expected), 7)
    np.testing.assert_allclose(
        have[np.lexsort(have.T)], sorted(expected, key=lambda row: row[::-1]), atol=1e-5
    )
    np.testing.assert_allclose(regions.variances, 0.25)


SMALL_GRID = GridSpec(0.1, (-4, 7), (20, 20))


def area_m2(corners: F32) -> float:
    """Of a polygon, positive if it runs counter-clockwise (Gauss)."""
    x, y = corners.astype(np.float64).T
    return float(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def contains(corners: F32, point: np.ndarray) -> bool:
    """Whether a polygon contains a point, by the crossings of a ray along x."""
    inside = False
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if (y0 > point[1]) != (y1 > point[1]):
            inside ^= point[0] < x0 + (x1 - x0) * (point[1] - y0) / (y1 - y0)
    return inside


@given(seed=st.integers(0, 2**16), density=st.floats(0.3, 0.9))
@settings(max_examples=25, deadline=None)
def test_the_polygon_contains_every_cell_and_few_others(seed: int, density: float) -> None:
    mask = np.random.default_rng(seed).random((12, 12)) < density
    parts, _ = ndimage.label(mask, np.ones((3, 3)))
    cells: I64 = np.argwhere(parts == 1)
    if len(cells) == 0:
        return
    corners = outline(cells, SMALL_GRID)
    assert len(np.unique(corners, axis=0)) == len(corners)
    assert all(contains(corners, centre) for centre in SMALL_GRID.centres(cells))
    grown = np.zeros((14, 14), bool)
    grown[tuple((cells + 1).T)] = True
    most = ndimage.binary_fill_holes(ndimage.binary_dilation(grown, np.ones((3, 3))))
    assert 0.01 * len(cells) - 1e-6 <= area_m2(corners) <= 0.01 * most.sum()
