"""Whether what a frame shows stands beside where the map has it: then the robot's pose is wrong.

Matching a scan against a map: it is counted how many obstacle cells of the frame meet what stands
on the map, as the pose has them and shifted by some cells. Where the pose is right no shift is much
better, since people and moved chairs are a small part of what is in view.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from onemap_shared.geometry import I64, U8
from onemap_shared.messages import Occupancy

REACH_CELLS = 6  # of the shifts, to each side
LEAST_CELLS = 3  # smaller ones are errors of a localisation that holds
MIN_CELLS = 30  # of obstacles in view: fewer say nothing
GAIN = 0.2  # more of them stand on the map when shifted
# Of those that do so only then, on floor that was free: a wall that is new to the map, beside one
# that is not, has few: 4 in a run that was not pushed, 6 or more after a push.
MIN_ON_FREE = 5
AROUND = np.ones((3, 3), bool)


def offset_cells(cells: I64, lasting: U8) -> float:
    """How far beside the map obstacle cells (n, 2) of a frame stand, in cells; 0 if they do not.

    lasting (nx, ny): values of ``Occupancy`` that lasted; the cells are indices in it,
    ``REACH_CELLS`` and more from its rim. A neighbour of what stands on the map counts as well.
    """
    if len(cells) < MIN_CELLS:
        return 0.0
    shifts = np.argwhere(np.ones((2 * REACH_CELLS + 1,) * 2, bool)) - REACH_CELLS
    shifts = shifts[np.hypot(*shifts.T) >= LEAST_CELLS]
    standing = ndimage.binary_dilation(lasting == Occupancy.OCCUPIED, AROUND)
    here = standing[tuple(cells.T)]
    shifted = standing[tuple(np.moveaxis(cells[:, None] + shifts, -1, 0))]
    best = int(shifted.sum(axis=0).argmax())
    there = shifted[:, best]
    on_free = there & ~here & (lasting[tuple(cells.T)] == Occupancy.FREE)
    if there.mean() - here.mean() < GAIN or on_free.sum() < MIN_ON_FREE:
        return 0.0
    return float(np.hypot(*shifts[best]))
