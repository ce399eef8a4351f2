"""Whether an object in a picture has a colour: the share of its pixels that the name fits."""

from __future__ import annotations

import io
from functools import lru_cache

import numpy as np
from PIL import Image

from onemap_planner.world.candidates import PictureOfObject
from onemap_shared.colours import lab_of, likeness

MIDDLE = 0.6  # of the box's sides: the rim shows what is behind the object
LEAST_PIXELS = 64  # of that middle: fewer are mixed with what is behind
FITS = 0.5  # likeness of a pixel that has the colour
CLEARLY, HARDLY = 0.25, 0.1  # share of the pixels from which it has the colour, below which not
DARK = 26.0  # lightness that the brightest tenth of a picture exceeds if there is light


def has_colour(view: PictureOfObject | None, colour: str) -> tuple[bool | None, str]:
    """Whether it has the colour, and why that was not checked, else empty.

    None: it cannot be told from so far. True also where it was not checked.
    """
    if view is None or not view.picture:
        return True, "there is no picture"
    share = _share(view.picture, view.box_px, colour)
    if share is None:
        return True, "too dark"
    if share >= CLEARLY:
        return True, ""
    return (None if np.isnan(share) or share >= HARDLY else False), ""


@lru_cache(maxsize=64)  # a picture stays the best one for many steps
def _share(picture: bytes, box_px: tuple[float, float, float, float], colour: str) -> float | None:
    """Share of the object's pixels that have the colour; NaN: too few; None: it is dark."""
    with Image.open(io.BytesIO(picture)) as image:
        lab = lab_of(np.asarray(image.convert("RGB")))
    if np.quantile(lab[..., 0], 0.9) < DARK:
        return None
    (x0, y0), (x1, y1) = np.reshape(box_px, (2, 2))
    rim = np.array([x1 - x0, y1 - y0]) * (1 - MIDDLE) / 2
    left, top = np.rint((x0, y0) + rim).astype(int)
    right, bottom = np.rint((x1, y1) - rim).astype(int)
    own = lab[max(top, 0) : bottom, max(left, 0) : right].reshape(-1, 3)
    if len(own) < LEAST_PIXELS:
        return float("nan")
    return float((likeness(own, colour) >= FITS).mean())
