"""Names of colours, and how well each fits a colour of CIE Lab.

In Lab the angle of (a, b) is the hue and its length the chroma. Where paint mixes with a grey wall,
or lies in the shade, chroma and lightness fall and the hue stays, so that a mean can be named.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from onemap_shared.geometry import F32, U8

Span = tuple[float, float]


class ColourRange(NamedTuple):
    """What a name covers, from and to: hue in degrees (it may pass through 0), chroma, and
    lightness in [0, 100]."""

    hue_deg: Span
    chroma: Span
    lightness: Span


ANY_HUE, MOST = (0.0, 360.0), 150.0
# Of each colour of the grammar. They overlap, as words do: a wall in the shade is white and grey.
RANGES: Mapping[str, ColourRange] = MappingProxyType(
    {
        "black": ColourRange(ANY_HUE, (0, 20), (0, 24)),
        "grey": ColourRange(ANY_HUE, (0, 12), (22, 80)),
        "white": ColourRange(ANY_HUE, (0, 14), (66, 100)),
        "brown": ColourRange((45, 88), (14, 60), (14, 58)),
        "red": ColourRange((8, 48), (28, MOST), (14, 65)),
        "orange": ColourRange((45, 80), (40, MOST), (40, 90)),
        "yellow": ColourRange((78, 112), (28, MOST), (40, 100)),
        "green": ColourRange((108, 195), (14, MOST), (14, 100)),
        "blue": ColourRange((195, 312), (12, MOST), (12, 100)),
        "purple": ColourRange((309, 345), (14, MOST), (10, 85)),
        "pink": ColourRange((325, 30), (10, 70), (52, 100)),
    }
)
# Beyond a name's range, until it fits by half: a and b, and lightness, which shade changes most.
FADE, LIGHTNESS_FADE = 6.0, 12.0
# Linear sRGB to XYZ of the white point D65, and that white.
XYZ_OF_RGB = np.array(
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]], np.float32
)
WHITE = XYZ_OF_RGB.sum(axis=1)


def lab_of(rgb: U8) -> F32:
    """CIE Lab (..., 3) float32 of sRGB (..., 3) uint8: L in [0, 100], a and b within +-128."""
    share = rgb.astype(np.float32) / np.float32(255)
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    xyz = linear.astype(np.float32) @ XYZ_OF_RGB.T / WHITE
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    x, y, z = np.moveaxis(f, -1, 0)
    lab: F32 = np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1).astype(np.float32)
    return lab


DARK = 26.0  # lightness that the brightest tenth of a picture exceeds if there is light


def is_dark(lab: F32) -> bool:
    """Whether a picture (..., 3), Lab, has too little light to tell any colour of what it shows."""
    return bool(np.quantile(lab[..., 0], 0.9) < DARK)


OFFSET, SCALE = np.array([0, 128, 128], np.float32), np.array([2.55, 1, 1], np.float32)


def packed(lab: F32) -> U8:
    """Lab (..., 3) in a byte each: 2.55 L, a + 128, b + 128; (0, 0, 0), which is no colour, for
    NaN."""
    whole = np.rint(np.clip(lab * SCALE + OFFSET, 0, 255))
    return np.where(np.isnan(lab), 0, whole).astype(np.uint8)


def unpacked(colours: U8) -> F32:
    """The Lab (..., 3) float32 of ``packed``."""
    lab: F32 = (colours.astype(np.float32) - OFFSET) / SCALE
    lab[(colours == 0).all(axis=-1)] = np.nan
    return lab


def likeness(lab: F32, colour: str) -> F32:
    """How well the name of a colour fits Lab (..., 3), (...) float32 in [0, 1]; NaN for NaN.

    1 in its range of ``RANGES``, and 2^-((d / f)^2) at a distance d beyond it, so that grey is like
    no hue, though its own hue is noise.
    """
    hue_deg, chroma, lightness = RANGES[colour]
    L, a, b = np.moveaxis(lab, -1, 0)
    length = np.hypot(a, b)
    width = (hue_deg[1] - hue_deg[0]) % 360 or 360.0
    from_middle = (np.degrees(np.arctan2(b, a)) - hue_deg[0] - width / 2 + 180) % 360 - 180
    turn = np.radians(np.clip(np.abs(from_middle) - width / 2, 0, 90))
    away = np.hypot(length * np.sin(turn), _beyond(length, chroma)) / FADE
    shaded = _beyond(L, lightness) / LIGHTNESS_FADE
    fits: F32 = np.exp2(-(away**2) - shaded**2).astype(np.float32)
    return fits


def _beyond(values: F32, span: Span) -> F32:
    outside: F32 = np.maximum(np.maximum(span[0] - values, values - span[1]), 0)
    return outside
