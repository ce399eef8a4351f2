"""Colours of the map: distinguishable, and the same in the image, on the page and in its legend."""

from __future__ import annotations

import re
from dataclasses import asdict

import pytest

from onemap_gateway.http.routes.pages import STATIC
from onemap_gateway.present.palette import DARK, LIGHT, PALETTES, Palette, Rgb, Theme

TEXT_CONTRAST = 4.5  # WCAG 2.2 AA, 1.4.3
MARK_CONTRAST = 3.0  # 1.4.11
ON_THE_PAGE = {"found": "find"}  # fields that the page calls otherwise
BOTH = pytest.mark.parametrize("palette", [DARK, LIGHT], ids=["dark", "light"])


def luminance(colour: Rgb) -> float:
    linear = [
        c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
        for c in (value / 255 for value in colour)
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(a: Rgb, b: Rgb) -> float:
    darker, brighter = sorted((luminance(a), luminance(b)))
    return (brighter + 0.05) / (darker + 0.05)


def hexadecimal(colour: Rgb) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)


@BOTH
def test_texts_contrast_with_their_outline(palette: Palette) -> None:
    for colour in (palette.found, palette.region, palette.ink):
        assert contrast(colour, palette.unknown) >= TEXT_CONTRAST


@BOTH
@pytest.mark.parametrize("mark", ["trail", "path", "frontier", "region", "robot", "found"])
def test_marks_contrast_with_the_floor(palette: Palette, mark: str) -> None:
    for ground in (palette.free, palette.unknown):
        assert contrast(getattr(palette, mark), ground) >= MARK_CONTRAST


@BOTH
def test_walls_contrast_with_the_floor(palette: Palette) -> None:
    assert contrast(palette.occupied, palette.free) >= MARK_CONTRAST


@BOTH
def test_heat_moves_away_from_the_floor(palette: Palette) -> None:
    """Monotone in brightness: the heatmap can be read in grey."""
    distances = [contrast(colour, palette.free) for colour in palette.heat]
    brightness = [luminance(colour) for colour in palette.heat]
    assert brightness in (sorted(brightness), sorted(brightness, reverse=True))
    assert max(distances) == distances[-1]


@pytest.mark.parametrize("theme", list(Theme))
def test_the_page_has_the_same_colours(theme: Theme) -> None:
    dark, _, light = (STATIC / "style.css").read_text("utf-8").partition("@media (prefers-color")
    text = dark if theme is Theme.DARK else light
    for name, colour in asdict(PALETTES[theme]).items():
        found = re.search(rf"--map-{ON_THE_PAGE.get(name, name)}: ([^;]+);", text)
        assert found, name
        expected = colour if name == "heat" else (colour,)
        assert found[1] == ", ".join(map(hexadecimal, expected)), name
