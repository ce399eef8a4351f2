"""Animations as files."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from onemap_shared.geometry import U8
from onemap_tools.demo.film.encoding import FORMATS, MARKS, check_film, encode_animation
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError


def pictures(count: int) -> list[U8]:
    """A page on which a square moves, beside a line of every mark's colour."""
    page = np.full((count, 60, 80, 3), 20, np.uint8)
    for number, mark in enumerate(MARKS):
        page[:, 2 * number, 60:70] = mark
    for number in range(count):
        page[number, 40:45, 5 * number : 5 * number + 5] = (200, 90, 30)
    return list(page)


@pytest.mark.parametrize("ending", FORMATS)
def test_a_film_reads_back(ending: str) -> None:
    drawn, durations = pictures(6), [100, 200, 100, 100, 300, 2000]
    with Image.open(io.BytesIO(encode_animation(drawn, durations, ending))) as film:
        assert film.format == FORMATS[ending]
        assert film.n_frames == 6
        assert film.info["loop"] == 0
        for number, picture in enumerate(drawn):
            film.seek(number)
            shown = np.asarray(film.convert("RGB")).astype(int)
            assert film.info["duration"] == durations[number]
            assert np.abs(shown - picture).mean() < 4


@pytest.mark.parametrize("ending", [".gif", ".png"])
def test_marks_keep_their_colour_among_many_others(ending: str) -> None:
    noise = np.random.default_rng(0).integers(0, 256, (60, 60, 3), dtype=np.uint8)
    drawn = pictures(2)
    for picture in drawn:
        picture[:, :60] = noise
    with Image.open(io.BytesIO(encode_animation(drawn, [100, 100], ending))) as film:
        shown = np.asarray(film.convert("RGB"))
    for number, mark in enumerate(MARKS):
        assert np.all(shown[2 * number, 60:70] == mark)


def test_the_name_of_a_film_says_its_format(tmp_path: Path) -> None:
    for ending in FORMATS:
        check_film(tmp_path / f"search{ending.upper()}")
    for name in ("search.mp4", "search"):
        with pytest.raises(CliError, match=r"ends in \.webp, \.gif or \.png") as error:
            check_film(tmp_path / name)
        assert error.value.exit_code == EXIT_USAGE_ERROR
    with pytest.raises(CliError, match=r"there is no folder .*nowhere: make it first"):
        check_film(tmp_path / "nowhere" / "search.gif")
