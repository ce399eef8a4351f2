"""The colour of heat over the map, pixel by pixel."""

from __future__ import annotations

import numpy as np

from onemap_gateway.present.palette import Palette
from onemap_gateway.present.render import HEATMAP_OPACITY, HEATMAP_THRESHOLD
from onemap_shared.geometry import F32, U8


def heated(image: U8, heat: F32, inside: U8, palette: Palette) -> U8:
    """``image`` (H, W, 3) with the colour of heat (H, W), in [0, 1], where ``inside`` is 1.

    Opacity: ``HEATMAP_OPACITY * sqrt(heat - HEATMAP_THRESHOLD)``.
    """
    result: U8 = image.copy()
    stops = np.linspace(0, 1, len(palette.heat))
    for row, column in np.argwhere(inside):
        value = float(heat[row, column])
        opacity = HEATMAP_OPACITY * max(value - HEATMAP_THRESHOLD, 0.0) ** 0.5
        for channel in range(3):
            ink = np.interp(value, stops, [colour[channel] for colour in palette.heat])
            before = float(image[row, column, channel])
            result[row, column, channel] = round(before + opacity * (ink - before))
    return result
