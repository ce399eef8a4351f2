"""Files are replaced as a whole; what a cut off write left is swept."""

from __future__ import annotations

import secrets
from pathlib import Path

import pytest

from onemap_mapper.storage.atomic_file import replacing, sweep_leftovers


def test_a_file_is_replaced_as_a_whole(tmp_path: Path) -> None:
    path = tmp_path / "new" / "a.bin"
    for content in (b"one", b"two"):
        with replacing(path) as file:
            file.write(content)
        assert path.read_bytes() == content
    assert list(path.parent.iterdir()) == [path]


def test_a_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")

    def fail() -> None:
        with replacing(path) as file:
            file.write(b"half")
            raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space"):
        fail()
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_under_the_temporary_name_is_not_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    victim, folder = tmp_path / "victim", tmp_path / "maps"
    victim.write_bytes(b"precious")
    folder.mkdir()
    monkeypatch.setattr(secrets, "token_hex", lambda _bytes: "guessed")
    (folder / ".a.bin.guessed.part").symlink_to(victim)
    with pytest.raises(FileExistsError), replacing(folder / "a.bin") as file:
        file.write(b"overwritten")
    assert victim.read_bytes() == b"precious"


def test_leftovers_of_cut_off_writes_are_swept(tmp_path: Path) -> None:
    for name in (".a.npz.12.part", ".b.part", "keep.part", "c.npz"):
        (tmp_path / name).write_bytes(b"x")
    assert sweep_leftovers(tmp_path) == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.npz", "keep.part"]
    assert sweep_leftovers(tmp_path / "none") == 0
