"""Distances, connected parts and dilation of boolean masks over floor cells, by OpenCV.

All masks are (nx, ny) bool over the cells of a grid; cells are connected by their edges.
"""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import F32, I64, Bool

FAST_MASK = 5  # OpenCV's 5 x 5 chamfer distance: within 2 % of the exact one, and faster


def distance_m(mask: Bool, cell_size_m: float, *, exact: bool = True) -> F32:
    """Distance (nx, ny) float32 in metres from each cell's centre to the nearest of the mask.

    Without any cell in the mask it is very large.
    """
    kernel = cv2.DIST_MASK_PRECISE if exact else FAST_MASK
    cells = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, kernel)
    distance: F32 = np.asarray(cells, np.float32) * np.float32(cell_size_m)
    return distance


def clearance_m(occupied: Bool, cell_size_m: float) -> F32:
    """Distance (nx, ny) float32 in metres from each cell's centre to the nearest occupied one's.

    Beyond the grid counts as occupied.
    """
    padded = np.pad(occupied, 1, constant_values=True)
    inner: F32 = distance_m(padded, cell_size_m)[1:-1, 1:-1]
    return inner


def connected_part(mask: Bool, cell: I64) -> Bool:
    """The part of the mask that is connected to a cell (2,); empty if the cell is outside it."""
    _, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=4)
    part: Bool = mask & (labels == labels[cell[0], cell[1]]) & bool(mask[cell[0], cell[1]])
    return part


def largest_part(mask: Bool) -> Bool:
    """The connected part of the mask with the most cells; empty if the mask is."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(
        mask.astype(np.uint8), connectivity=4
    )
    if count < 2:
        return np.zeros_like(mask)
    part: Bool = labels == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    return part


def dilated(mask: Bool) -> Bool:
    """The mask and the eight neighbours of each of its cells."""
    return cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
