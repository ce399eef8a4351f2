"""Colours of the map's cells, for viewers that show pictures of a grid.

Every function gives (nx, ny, 4) uint8 red, green, blue, alpha, indexed [ix, iy] as the map;
alpha 0 where a cell has nothing to show.
"""

from __future__ import annotations

import numpy as np

from onemap_gateway.present.palette import DARK, Rgb
from onemap_shared.geometry import F32, U8
from onemap_shared.messages import Layer, Occupancy

OPAQUE, TINT = 255, 110
MIN_TOP = 0.25  # least score of full heat: a weak best match must not look like a find
LAYERS: dict[Layer, Rgb] = {
    Layer.OBSERVED: (92, 108, 190),
    Layer.EXPLORED: (80, 190, 175),
    Layer.SEARCHED: (235, 200, 90),
}


def occupancy_rgba(occupancy: U8) -> U8:
    """Free and occupied cells of (nx, ny) values of ``Occupancy``; unknown ones transparent."""
    colours = np.zeros((len(Occupancy), 4), np.uint8)
    colours[Occupancy.FREE] = (*DARK.free, OPAQUE)
    colours[Occupancy.OCCUPIED] = (*DARK.occupied, OPAQUE)
    coloured: U8 = colours[np.minimum(occupancy, len(colours) - 1)]
    return coloured


def belief_rgba(layers: U8) -> U8:
    """How well cells are known, of (nx, ny) bits of ``Layer``: observed, explored, searched."""
    coloured: U8 = np.zeros((*layers.shape, 4), np.uint8)
    for layer, colour in LAYERS.items():
        coloured[(layers & layer) != 0] = (*colour, TINT)
    return coloured


def similarity_rgba(similarity: F32) -> U8:
    """Heat of scores (nx, ny) in [0, 1], relative to the best; NaN and 0 are transparent.

    The best score counts at least as ``MIN_TOP``, as on the live page.
    """
    scored = np.isfinite(similarity)
    top = max(float(similarity.max(where=scored, initial=0.0)), MIN_TOP)
    heat = np.clip(np.where(scored, similarity, 0.0) / top, 0.0, 1.0)
    colours = np.array(DARK.heat, np.float64)
    stops = np.linspace(0.0, 1.0, len(colours))
    coloured: U8 = np.zeros((*similarity.shape, 4), np.uint8)
    for channel in range(3):
        coloured[..., channel] = np.rint(np.interp(heat, stops, colours[:, channel]))
    coloured[..., 3] = np.rint(OPAQUE * np.sqrt(heat)) * scored
    return coloured
