"""Occupancy of a map of boxes against the boxes."""

from __future__ import annotations

import numpy as np

from onemap_mapper.config import MapperConfig
from onemap_shared.messages import Occupancy
from onemap_tools.bench.occupancy import driven, obstacles, overlaps
from tests.simulator.scenes import box_room


def test_ideal_depth_agrees_with_the_geometry() -> None:
    scene = box_room()
    belief = driven(scene, 0.0, 1, MapperConfig())
    found = overlaps(belief.occupancy_grid(), obstacles(scene, belief))
    assert found["iou_free"] > 0.9
    assert found["known_cells"] > 1000
    assert belief.dimension == 0


def test_overlaps_are_of_known_cells() -> None:
    free, occupied = Occupancy.FREE, Occupancy.OCCUPIED
    states = np.array([[free, free, occupied, occupied, occupied, Occupancy.UNKNOWN]], np.uint8)
    obstacle = np.array([[False, True, True, False, False, False]])
    assert overlaps(states, obstacle) == {
        "known_cells": 4,  # the occupied cell beside the obstacle is left out
        "iou_free": 0.333,
        "iou_occupied": 0.333,
        "false_occupied": 0.5,
        "false_free": 0.5,
    }
