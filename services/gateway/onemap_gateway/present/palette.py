"""Colours of the map image, for dark and for light pages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

Rgb: TypeAlias = tuple[int, int, int]


class Theme(str, Enum):
    """Whether the page around the image is dark or light."""

    DARK = "dark"
    LIGHT = "light"


@dataclass(frozen=True, slots=True)
class Palette:
    """RGB of everything in the map image.

    ``wall``: what stands taller than a person's chest, ``occupied`` what is lower or not known.
    ``heat``: at heat 0, 1/3, 2/3 and 1; away from the floor's brightness, so that it also works
    in grey. ``unknown`` is also the outline of texts and marks.
    """

    unknown: Rgb
    free: Rgb
    occupied: Rgb
    wall: Rgb
    trail: Rgb
    path: Rgb
    frontier: Rgb
    region: Rgb
    robot: Rgb
    found: Rgb
    ink: Rgb
    heat: tuple[Rgb, Rgb, Rgb, Rgb]


DARK = Palette(
    unknown=(15, 20, 27),
    free=(40, 50, 63),
    occupied=(110, 127, 147),
    wall=(222, 230, 238),
    trail=(130, 150, 175),
    path=(76, 201, 240),
    frontier=(94, 214, 160),
    region=(255, 190, 92),
    robot=(245, 248, 252),
    found=(255, 111, 145),
    ink=(214, 223, 233),
    heat=((82, 40, 130), (196, 58, 98), (250, 142, 60), (255, 236, 150)),
)

LIGHT = Palette(
    unknown=(224, 229, 236),
    free=(250, 251, 253),
    occupied=(128, 142, 160),
    wall=(44, 54, 68),
    trail=(92, 108, 128),
    path=(0, 92, 138),
    frontier=(18, 107, 69),
    region=(138, 80, 0),
    robot=(20, 28, 38),
    found=(176, 16, 66),
    ink=(34, 44, 56),
    heat=((255, 228, 140), (248, 160, 80), (214, 72, 96), (110, 44, 140)),
)

PALETTES: Mapping[Theme, Palette] = {Theme.DARK: DARK, Theme.LIGHT: LIGHT}
