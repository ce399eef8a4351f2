"""Flying pixels: depth between front and back at an edge, where nothing is.

Stereo and time-of-flight cameras average both surfaces in a pixel at the edge. As obstacles such
points close doors. A pixel of a surface has neighbours at about its depth, whichever way the
surface slants: along the edge, or along the horizontal where floor is seen at a flat angle.
"""

from __future__ import annotations

import numpy as np

from onemap_mapper.kernels.alike import few_alike
from onemap_shared.geometry import F32, Bool

ALIKE = 0.04  # of the depth: 12 cm at 3 m, three times the noise of a stereo camera there
NEIGHBOURS = 2  # of the eight: as a pixel of a vertical or horizontal line one pixel wide has
STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))  # rows, columns: half of the eight neighbours


def flying_pixels(depth_m: F32, *, compiled: bool = False) -> Bool:
    """Mask (H, W) of the pixels with depth that have fewer than two of eight neighbours alike.

    Pixels at the rim of the image have fewer neighbours and are kept. compiled: by the compiled
    loop, with the same result.
    """
    if compiled:
        return few_alike(np.ascontiguousarray(depth_m), ALIKE, NEIGHBOURS)
    alike = np.full(depth_m.shape, NEIGHBOURS, np.uint8)
    alike[1:-1, 1:-1] = 0
    limit = ALIKE * depth_m
    rows, columns = depth_m.shape
    for down, right in STEPS:
        here = (slice(0, rows - down), slice(max(-right, 0), columns - max(right, 0)))
        there = (slice(down, rows), slice(max(right, 0), columns + min(right, 0)))
        close = np.abs(depth_m[here] - depth_m[there]) <= limit[here]
        alike[here] += close
        alike[there] += close
    mask: Bool = (alike < NEIGHBOURS) & (depth_m > 0)
    return mask
