"""Which world the checkpoints and the found objects of a map folder belong to.

A world is what poses are in: a robot's namespace, and the name that its frames give. What the
folder holds of another one is set aside, with the text that names it.
"""
# Touches files: the world of a map folder.

from __future__ import annotations

from itertools import count
from pathlib import Path

from onemap_mapper import checkpoint_file, object_file
from onemap_mapper.storage.map_file import replacing

FILE_NAME = "world.txt"
ASIDE = "other_worlds"  # inside the map folder
MAX_CHARS = 400


def read(folder: Path) -> str:
    """The world of what the folder holds; empty if that is not known, as of earlier releases."""
    try:
        return (folder / FILE_NAME).read_text(encoding="utf-8", errors="replace")[:MAX_CHARS]
    except OSError:
        return ""


def write(folder: Path, world: str) -> None:
    """Raises OSError."""
    with replacing(folder / FILE_NAME) as file:
        file.write(world.encode())


def set_aside(folder: Path) -> Path:
    """Move what the folder holds into a new folder beside it, which is returned; raises OSError."""
    kept = [*checkpoint_file.all_of(folder), folder / object_file.FILE_NAME, folder / FILE_NAME]
    aside = next(path for number in count(1) if not (path := folder / ASIDE / str(number)).exists())
    aside.mkdir(parents=True)
    for path in filter(Path.exists, kept):
        path.rename(aside / path.name)
    return aside
