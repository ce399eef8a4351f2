"""Connected components of masks on the grid."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from onemap_shared.geometry import I64, Bool

CONNECTIVITY_8 = np.ones((3, 3), bool)  # diagonal neighbours are neighbours


def components(mask: Bool) -> list[I64]:
    """Cells (K, 2) of each 8-connected component of the mask (nx, ny), row by row."""
    labels, count = ndimage.label(mask, CONNECTIVITY_8)
    cells = np.argwhere(mask)
    label = labels[mask]
    sizes = np.bincount(label, minlength=count + 1)[1:]
    return np.split(cells[np.argsort(label, kind="stable")], np.cumsum(sizes))[:count]
