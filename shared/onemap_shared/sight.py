"""Which cells of a map can be seen from one of them."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from onemap_shared.geometry import U8, Bool
from onemap_shared.messages import Occupancy

RAYS = 72  # 5 degrees: 0.26 m apart at 3 m, so that a door is three rays wide
EIGHT_NEIGHBOURS = np.ones((3, 3), bool)


def in_sight(occupancy: U8) -> Bool:
    """Cells (2 r + 1, 2 r + 1) within r of the middle one that no occupied cell hides from it."""
    reach = len(occupancy) // 2
    angles = 2 * np.pi * np.arange(RAYS) / RAYS
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    steps = np.arange(1, reach + 1)
    x, y = np.moveaxis(reach + np.rint(directions[:, None] * steps[:, None]).astype(int), -1, 0)
    clear = ~np.maximum.accumulate(occupancy[x, y] == Occupancy.OCCUPIED, axis=1)
    seen = np.zeros(occupancy.shape, bool)
    seen[x[clear], y[clear]] = True
    closed: Bool = ndimage.binary_closing(seen, EIGHT_NEIGHBOURS)  # gaps between rays
    return closed
