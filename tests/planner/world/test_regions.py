"""Regions are similar and observed; at last any somewhat similar place counts."""

import numpy as np
import pytest

from onemap_planner.world.regions import find_regions, remaining_regions
from tests.planner.drawn_maps import PARAMS, drawn_map


def test_regions_are_similar_and_observed() -> None:
    rows = ("#######", "#oo., #", "#######")
    similarity = np.full((15, 35), 0.1, np.float32)
    similarity[7, 7] = 0.8
    similarity[8, 8] = 0.6
    similarity[7, 16] = 0.9  # searched, maybe from too far for the detector
    similarity[7, 22] = 0.7  # not explored: seen from afar only
    similarity[7, 27] = 0.9  # not observed
    map_view = drawn_map(*rows, scale=5, similarity=similarity)
    searched, region, seen_from_afar = find_regions(map_view, PARAMS.region)
    assert [searched.score, seen_from_afar.score] == pytest.approx([0.9, 0.7])
    assert region.score == pytest.approx(0.8)
    assert region.cells.tolist() == [[7, 7], [8, 8]]
    np.testing.assert_allclose(region.peak_xy, [0.75, 0.75])


def test_regions_come_best_first_and_large_enough() -> None:
    similarity = np.full((5, 10), 0.1, np.float32)
    similarity[1, 1], similarity[3, 8] = 0.5, 0.6
    map_view = drawn_map("oo", scale=5, similarity=similarity)
    assert [region.score for region in find_regions(map_view, PARAMS.region)] == pytest.approx(
        [0.6, 0.5]
    )


def test_remaining_regions_are_the_best_anywhere_and_large_enough() -> None:
    similarity = np.full((5, 10), 0.05, np.float32)
    similarity[1, 1], similarity[3, 8] = 0.2, 0.6
    map_view = drawn_map("..", scale=5, similarity=similarity)
    assert len(find_regions(map_view, PARAMS.region)) == 1
    assert len(remaining_regions(map_view, PARAMS.region)) == 2
    best = remaining_regions(map_view, PARAMS.region.model_copy(update={"last_looks": 1}))
    assert [region.score for region in best] == pytest.approx([0.6])
    pickier = PARAMS.region.model_copy(update={"min_area_m2": 0.02})
    assert remaining_regions(map_view, pickier) == ()
