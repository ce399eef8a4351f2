"""The files of the checkpoints, in a folder of their own so that they are not listed as maps.

They are numbered, because clocks may be set back; the newest two are kept, so that one that
cannot be read leaves another.
"""
# Touches files: checkpoints.

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from onemap_mapper.storage import map_file
from onemap_mapper.storage.snapshot import MapFileError, MapSnapshot

FOLDER = "checkpoints"  # inside the map folder
KEPT = 2


def write(folder: Path, to_file: Callable[[Path], object]) -> Path:
    """Have ``to_file`` write the next checkpoint, then remove old ones; returns its path.

    Raises what ``to_file`` raises; then the old ones stay.
    """
    known = all_of(folder)
    path = folder / FOLDER / f"{_number(known[0]) + 1 if known else 1:08d}{map_file.SUFFIX}"
    to_file(path)
    for old in known[KEPT - 1 :]:
        old.unlink(missing_ok=True)
    return path


def newest(folder: Path) -> tuple[MapSnapshot | None, list[str]]:
    """The newest checkpoint that can be read, and why newer ones cannot, a sentence each."""
    problems: list[str] = []
    for path in all_of(folder):
        try:
            return map_file.read(path), problems
        except MapFileError as problem:
            problems.append(f"checkpoint {path} cannot be used: {problem}")
    return None, problems


def remove_all(folder: Path) -> None:
    """Remove the checkpoints, because the map was replaced. Raises OSError."""
    for path in all_of(folder):
        path.unlink(missing_ok=True)


def all_of(folder: Path) -> list[Path]:
    """All checkpoints, the newest first."""
    paths = (folder / FOLDER).glob(f"*{map_file.SUFFIX}")
    return sorted((path for path in paths if path.stem.isdecimal()), key=_number, reverse=True)


def _number(path: Path) -> int:
    return int(path.stem)
