from __future__ import annotations

import numpy as np

from onemap_gateway.present.palette import DARK
from onemap_shared.messages import Layer, Occupancy
from onemap_tools.viewers.map_colours import (
    EXPLORED,
    OBSERVED,
    SEARCHED,
    belief_rgba,
    occupancy_rgba,
    similarity_rgba,
)


def test_unknown_cells_are_transparent() -> None:
    occupancy = np.array([[Occupancy.UNKNOWN, Occupancy.FREE, Occupancy.OCCUPIED]], np.uint8)
    coloured = occupancy_rgba(occupancy)
    assert coloured[0, :, 3].tolist() == [0, 255, 255]
    assert tuple(coloured[0, 1, :3]) == DARK.free
    assert tuple(coloured[0, 2, :3]) == DARK.occupied


def test_the_strongest_layer_gives_the_colour() -> None:
    bits = [0, Layer.OBSERVED, Layer.OBSERVED | Layer.EXPLORED, 7]
    coloured = belief_rgba(np.array([bits], np.uint8))
    assert coloured[0, 0, 3] == 0
    assert [tuple(cell[:3]) for cell in coloured[0, 1:]] == [OBSERVED, EXPLORED, SEARCHED]


def test_heat_is_relative_to_the_best_score() -> None:
    scores = np.array([[np.nan, 0.0, 0.45, 0.9]], np.float32)
    coloured = similarity_rgba(scores)
    assert coloured[0, 0, 3] == coloured[0, 1, 3] == 0
    assert tuple(coloured[0, 3, :3]) == DARK.heat[-1]
    assert 0 < coloured[0, 2, 3] < coloured[0, 3, 3] == 255


def test_a_weak_best_match_does_not_look_like_a_find() -> None:
    assert similarity_rgba(np.array([[0.05]], np.float32))[0, 0, 3] < 128


def test_a_map_without_scores_has_no_heat() -> None:
    assert not similarity_rgba(np.full((2, 3), np.nan, np.float32))[..., 3].any()
    assert similarity_rgba(np.zeros((0, 0), np.float32)).shape == (0, 0, 4)
