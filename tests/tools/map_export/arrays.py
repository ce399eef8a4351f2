"""A small map of 3 x 2 cells, of which nothing is symmetric."""

from __future__ import annotations

import numpy as np

from onemap_shared.messages import Layer, Occupancy
from onemap_tools.map_export.map_arrays import MapArrays

UNKNOWN, FREE, OCCUPIED = Occupancy.UNKNOWN, Occupancy.FREE, Occupancy.OCCUPIED


def small_map(*, text: bool = True) -> MapArrays:
    """The occupancy as one sees it from above, y up: # . ? over . . #."""
    occupancy = np.array([[FREE, OCCUPIED], [FREE, FREE], [OCCUPIED, UNKNOWN]], np.uint8)
    layers = np.where(occupancy != UNKNOWN, Layer.OBSERVED, 0).astype(np.uint8)
    layers[0, 0] |= Layer.EXPLORED
    similarity = np.full((3, 2), np.nan, np.float32)
    similarity[0, 0], similarity[2, 0] = 0.2, 1.0
    none = np.zeros((0, 0), np.float32)
    return MapArrays(occupancy, layers, similarity if text else none, (-1.0, 2.0), 0.5)
