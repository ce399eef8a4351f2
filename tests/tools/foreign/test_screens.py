"""Pictures for screens and walls: of the shape asked for, functions of their seed."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_tools.foreign.images import PAINTINGS, book_spines
from onemap_tools.foreign.screens import SCREEN_SHAPE, SCREENS, switched_off


@pytest.mark.parametrize("maker", [*PAINTINGS, *SCREENS])
def test_a_picture_has_the_shape_asked_for(maker: object) -> None:
    assert callable(maker)
    image, again = (maker(np.random.default_rng(5), (120, 200)) for _ in range(2))
    assert image.shape == (120, 200, 3)
    assert image.dtype == np.uint8
    np.testing.assert_array_equal(image, again)


def test_a_screen_shows_something_unless_it_is_off() -> None:
    for maker in SCREENS:
        spread = maker(np.random.default_rng(6), SCREEN_SHAPE).std()
        assert (spread < 15) == (maker is switched_off)


def test_spines_stand_side_by_side() -> None:
    strip = book_spines(np.random.default_rng(7), 12)
    books = strip.reshape(strip.shape[0], 12, -1, 3).mean(axis=(0, 2))
    assert len(np.unique(books.round(), axis=0)) > 8
