"""The picture of a query is a PNG or JPEG; any other file is refused in one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest

from onemap_tools.cli.crop_file import read_crop
from onemap_tools.errors import CliError
from tests.shared.samples import PNG


def test_a_picture_is_read_as_it_is(tmp_path: Path) -> None:
    (path := tmp_path / "crop.png").write_bytes(PNG)
    assert read_crop(path) == PNG


def test_what_is_no_picture_is_refused(tmp_path: Path) -> None:
    (path := tmp_path / "crop.gif").write_bytes(b"GIF89a")
    with pytest.raises(CliError, match=r"crop\.gif: the image is no PNG and no JPEG"):
        read_crop(path)


def test_a_file_that_is_missing_is_named(tmp_path: Path) -> None:
    with pytest.raises(CliError, match=r"cannot read .*none\.png: No such file"):
        read_crop(tmp_path / "none.png")
