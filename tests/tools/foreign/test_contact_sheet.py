"""The pictures to be looked at."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from onemap_tools.foreign.contact_sheet import portrait_of, studio, tiled, write_pictures
from onemap_tools.foreign.finish_picker import LOFT, FinishPicker
from onemap_tools.foreign.shapes.catalogue import build_piece


def test_a_portrait_shows_the_whole_piece() -> None:
    piece = build_piece("chair", 2, FinishPicker(np.random.default_rng(0), LOFT))
    assert [thing.category for thing in studio(piece).scene.objects] == ["floor", "wall", "chair"]
    image = portrait_of(piece, 96).astype(int)
    assert image.shape == (96, 96, 3)
    border = np.concatenate([image[:4].reshape(-1, 3), image[-4:].reshape(-1, 3)])
    assert image[30:66, 30:66].std() > 2 * border.std()


def test_tiles_fill_whole_rows() -> None:
    images = [np.full((2, 3, 3), index, np.uint8) for index in range(9)]
    sheet = tiled(images)
    assert sheet.shape == (4, 12, 3)
    assert sheet[0, ::3, 0].tolist() == [0, 1, 2, 3]
    assert sheet[2, ::3, 0].tolist() == [4, 5, 6, 7]


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.touch()
    with pytest.raises(ValueError, match=r"cannot write to .*: Not a directory"):
        write_pictures(blocked / "out", lambda _: None)
