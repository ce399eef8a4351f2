"""Whether what a frame shows stands beside where the map has it: then the robot's pose is wrong.

Matching a scan against a map: it is counted how many obstacle cells of the frame meet what stands
on the map, as the pose has them and shifted by some cells. Where the pose is right no shift is much
better, since people and moved chairs are a small part of what is in view. What stands where the
map knows nothing yet does not count: a new wall would match the known one beside it.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from onemap_shared.geometry import I64, U8
from onemap_shared.messages import Occupancy

REACH_CELLS = 6  # of the shifts, to each side
LEAST_CELLS = 3  # smaller ones are errors of a localisation that holds
MIN_CELLS = 30  # of obstacles in view: fewer say nothing
GAIN = 0.1  # more of them, where the map is known, stand on it when shifted
# Of those that do so only then, on floor that was free: a wall that is new to the map, beside one
# that is not, has few: 4 in a run that was not pushed, 6 or more after a push.
MIN_ON_FREE = 5


def offset_cells(cells: I64, lasting: U8) -> float:
    """How far beside the map obstacle cells (n, 2) of a frame stand, in cells; 0 if they do not.

    lasting (nx, ny): values of ``Occupancy`` that lasted; the cells are indices in it,
    ``REACH_CELLS`` and more from its rim. A neighbour of what stands on the map counts as well.
    """
    if len(cells) < MIN_CELLS:
        return 0.0
    steps = np.arange(-REACH_CELLS, REACH_CELLS + 1)
    shifts = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    lengths = np.hypot(*shifts.T)
    standing = ndimage.binary_dilation(lasting == Occupancy.OCCUPIED, np.ones((3, 3), bool))
    x, y = cells.T
    here, free = standing[x, y], lasting[x, y] == Occupancy.FREE
    shifted = standing[x[:, None] + shifts[:, 0], y[:, None] + shifts[:, 1]]
    shifted &= (here | free)[:, None]
    best = np.where(lengths < LEAST_CELLS, -1, shifted.sum(axis=0)).argmax()
    there = shifted[:, best]
    gained = (int(there.sum()) - int(here.sum())) / len(cells)
    if gained < GAIN or (there & ~here).sum() < MIN_ON_FREE:
        return 0.0
    return float(lengths[best])
