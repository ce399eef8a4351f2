"""Films within their limit of bytes."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from onemap_tools.demo.film.film_file import write_film
from onemap_tools.errors import CliError
from tests.tools.demo.film.moments import moment

MOMENTS = [moment(0.5 * i, shade=20 * i) for i in range(10)]


@pytest.mark.parametrize("ending", [".webp", ".gif", ".png"])
def test_a_film_has_every_moment(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"search{ending}"
    facts = write_film(path, MOMENTS)
    assert facts.bytes == path.stat().st_size
    assert facts.length_s == pytest.approx(4.5 / 4 + 2.0, abs=0.02)
    with Image.open(path) as film:
        assert film.size == (960, 540)
        assert film.n_frames == facts.pictures == 10


def test_pictures_are_left_out_to_keep_the_limit(tmp_path: Path) -> None:
    path = tmp_path / "search.gif"
    whole = write_film(path, MOMENTS)
    smaller = write_film(path, MOMENTS, max_bytes=whole.bytes * 3 // 4)
    assert path.stat().st_size == smaller.bytes <= whole.bytes * 3 // 4
    assert 2 < smaller.pictures < whole.pictures
    assert smaller.length_s == pytest.approx(whole.length_s, abs=0.02)
    assert write_film(path, MOMENTS, max_bytes=1).pictures == 2


def test_one_moment_is_a_film(tmp_path: Path) -> None:
    assert write_film(tmp_path / "search.webp", MOMENTS[:1]).pictures == 1


def test_a_folder_that_is_gone_is_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "gone" / "search.gif"
    with pytest.raises(CliError, match=r"cannot be written to .*search\.gif: No such file"):
        write_film(path, MOMENTS[:1])
