"""Whether an object in a picture has a colour: the share of its pixels that the word covers."""

from __future__ import annotations

import io
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType

import numpy as np
from PIL import Image

from onemap_planner.world.candidates import PictureOfObject

# What each word of the grammar covers: hue in degrees (it may pass through 0), saturation and
# value in [0, 1], lowest and highest of each. They overlap, as words do: a wall in the shade is
# called white and grey.
RANGES: Mapping[str, tuple[tuple[float, float], ...]] = MappingProxyType(
    {
        "black": ((0, 360), (0.0, 1.0), (0.0, 0.25)),
        "grey": ((0, 360), (0.0, 0.2), (0.2, 0.8)),
        "white": ((0, 360), (0.0, 0.2), (0.65, 1.0)),
        "brown": ((5, 45), (0.25, 1.0), (0.15, 0.65)),
        "red": ((345, 15), (0.35, 1.0), (0.2, 1.0)),
        "orange": ((15, 45), (0.5, 1.0), (0.5, 1.0)),
        "yellow": ((42, 70), (0.3, 1.0), (0.45, 1.0)),
        "green": ((70, 170), (0.2, 1.0), (0.15, 1.0)),
        "blue": ((170, 260), (0.2, 1.0), (0.15, 1.0)),
        "purple": ((255, 320), (0.2, 1.0), (0.15, 1.0)),
        "pink": ((300, 15), (0.12, 0.65), (0.5, 1.0)),
    }
)
MIDDLE = 0.6  # of the box's sides: the rim shows what is behind the object
LEAST_PIXELS = 64  # of that middle: fewer are mixed with what is behind
CLEARLY, HARDLY = 0.25, 0.1  # share of the pixels from which it has the colour, below which not
DARK = 0.25  # value that the brightest tenth of a picture exceeds if there is light


def has_colour(view: PictureOfObject | None, colour: str) -> tuple[bool | None, str]:
    """Whether it has the colour, and why that was not checked, else empty.

    None: it cannot be told from so far. True also where it was not checked.
    """
    if view is None or not view.picture or colour not in RANGES:
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
        hsv = np.asarray(image.convert("HSV"), np.float64) / 255
    if np.quantile(hsv[..., 2], 0.9) < DARK:
        return None
    (x0, y0), (x1, y1) = np.reshape(box_px, (2, 2))
    rim = np.array([x1 - x0, y1 - y0]) * (1 - MIDDLE) / 2
    left, top = np.rint((x0, y0) + rim).astype(int)
    right, bottom = np.rint((x1, y1) - rim).astype(int)
    own = hsv[max(top, 0) : bottom, max(left, 0) : right].reshape(-1, 3)
    if len(own) < LEAST_PIXELS:
        return float("nan")
    (first, last), *limits = RANGES[colour]
    hue = 360 * own[:, 0]
    within = (hue >= first) & (hue <= last) if first <= last else (hue >= first) | (hue <= last)
    for value, (low, high) in zip(own[:, 1:].T, limits, strict=True):
        within &= (value >= low) & (value <= high)
    return float(within.mean())
