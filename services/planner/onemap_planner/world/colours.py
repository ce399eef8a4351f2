"""Whether an object in a picture has a colour: the share of its pixels that the name fits."""

from __future__ import annotations

import io
from functools import lru_cache

import numpy as np
from PIL import Image

from onemap_planner.world.candidates import PictureOfObject
from onemap_shared.colours import is_dark, lab_of, likeness
from onemap_shared.messages import Holds

MIDDLE = 0.6  # of the box's sides: the rim shows what is behind the object
LEAST_PIXELS = 64  # of that middle: fewer are mixed with what is behind
FITS = 0.5  # likeness of a pixel that has the colour
CLEARLY, HARDLY = 0.25, 0.1  # share of the pixels from which it has the colour, below which not
TOO_DARK = "it is too dark"


def has_colour(view: PictureOfObject | None, colour: str) -> tuple[Holds, str]:
    """Whether it has the colour, and why that was not checked, else empty."""
    if view is None or not view.picture:
        return Holds.NOT_CHECKED, "there is no picture of it"
    share = _share(view.picture, view.box_px, colour)
    if share is None:
        return Holds.NOT_CHECKED, TOO_DARK
    if share >= CLEARLY:
        return Holds.YES, ""
    if np.isnan(share):
        return Holds.NOT_CHECKED, "it was seen from too far"
    return (Holds.NOT_CHECKED, "only a part of it is") if share >= HARDLY else (Holds.NO, "")


@lru_cache(maxsize=64)  # a picture stays the best one for many steps
def _share(picture: bytes, box_px: tuple[float, float, float, float], colour: str) -> float | None:
    """Share of the object's pixels that have the colour; NaN: too few; None: it is dark."""
    with Image.open(io.BytesIO(picture)) as image:
        lab = lab_of(np.asarray(image.convert("RGB")))
    if is_dark(lab):
        return None
    (x0, y0), (x1, y1) = np.reshape(box_px, (2, 2))
    rim = np.array([x1 - x0, y1 - y0]) * (1 - MIDDLE) / 2
    left, top = np.rint((x0, y0) + rim).astype(int)
    right, bottom = np.rint((x1, y1) - rim).astype(int)
    own = lab[max(top, 0) : bottom, max(left, 0) : right].reshape(-1, 3)
    if len(own) < LEAST_PIXELS:
        return float("nan")
    return float((likeness(own, colour) >= FITS).mean())
