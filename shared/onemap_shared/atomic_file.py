"""Files that are replaced as a whole or not at all."""
# Touches files: what is written in one piece.

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

LEFTOVERS = ".*.part"


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A file to write; at the end it takes the place of ``path`` as a whole, or not at all.

    It is made under a name that nobody can guess and opened only if it is new, so that no link
    put there is followed. File and folder are synchronised: the new file outlives a loss of power.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(8)}.part")
    try:
        with temporary.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
        _sync_folder(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


def sweep_leftovers(folder: Path) -> int:
    """Remove what writes that were cut off left in a folder; returns how many. Raises OSError."""
    leftovers = list(folder.glob(LEFTOVERS))
    for path in leftovers:
        path.unlink(missing_ok=True)
    return len(leftovers)


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
