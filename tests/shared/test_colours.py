"""Colours by name: what each covers, mixed or in the shade too, and how they travel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from skimage.color import rgb2lab

from onemap_shared.colours import RANGES, lab_of, likeness, packed, unpacked
from onemap_shared.geometry import U8
from onemap_shared.sentence import COLOURS

SEEN = {
    **{"black": (20, 20, 22), "grey": (120, 122, 125), "white": (235, 235, 230)},
    **{"brown": (110, 70, 40), "red": (190, 30, 35), "orange": (240, 140, 30)},
    **{"yellow": (230, 210, 60), "green": (40, 130, 60), "blue": (40, 70, 170)},
    **{"purple": (120, 50, 160), "pink": (240, 150, 190)},
}
RGB = st.tuples(*[st.integers(0, 255)] * 3)


def pixels(*rgb: tuple[int, int, int]) -> U8:
    return np.array(rgb, np.uint8)


def best(rgb: tuple[float, float, float]) -> str:
    lab = lab_of(np.rint(rgb).astype(np.uint8))
    return max(RANGES, key=lambda name: float(likeness(lab, name)))


def test_each_colour_of_a_sentence_has_a_range() -> None:
    assert set(RANGES) == set(COLOURS.values()) == set(SEEN)


@given(st.lists(RGB, min_size=1, max_size=20))
def test_lab_is_that_of_scikit_image(colours: list[tuple[int, int, int]]) -> None:
    image = pixels(*colours)
    np.testing.assert_allclose(lab_of(image), rgb2lab(image), atol=0.05)


@given(RGB)
def test_a_colour_travels_in_three_bytes(rgb: tuple[int, int, int]) -> None:
    lab = lab_of(pixels(rgb))
    sent = packed(lab)
    assert sent.any()  # zeros stand for none
    np.testing.assert_allclose(unpacked(sent), lab, atol=0.51)
    assert np.isnan(unpacked(packed(np.full((1, 3), np.nan, np.float32)))).all()


@pytest.mark.parametrize("colour", SEEN)
def test_a_colour_fits_its_own_name_best(colour: str) -> None:
    fits = {name: float(likeness(lab_of(pixels(SEEN[colour])), name)[0]) for name in RANGES}
    assert fits[colour] == 1.0
    near = {"black", "grey", "white", colour}
    assert max(fits[name] for name in RANGES if name not in near) < 0.8


@pytest.mark.parametrize("colour", ["red", "yellow", "green", "blue", "purple"])
def test_a_colour_keeps_its_name_in_the_shade_and_mixed_with_a_wall(colour: str) -> None:
    paint = np.array(SEEN[colour])
    assert best(tuple(0.6 * paint)) == best(tuple(0.6 * paint + 0.4 * 150)) == colour


@given(RGB, st.sampled_from(sorted(RANGES)))
def test_a_likeness_is_a_share(rgb: tuple[int, int, int], colour: str) -> None:
    assert 0.0 <= float(likeness(lab_of(pixels(rgb)), colour)[0]) <= 1.0
    assert np.isnan(likeness(np.full((1, 3), np.nan, np.float32), colour)).all()
