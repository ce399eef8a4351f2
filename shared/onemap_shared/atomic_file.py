"""The door through which services change files: replaced whole or not at all, and kept for good.

What returned without an error is on disk: it outlives a kill and a loss of power. A path knows its
disk: those of ``pathlib`` are this computer's, those of a virtual computer are of another class.
"""
# Touches files: whatever a service writes.

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, BinaryIO, Protocol

LEFTOVERS = ".*.part"


class Disk(Protocol):
    """Makes lasting what the methods of a path have changed."""

    def sync(self, file: IO[bytes]) -> None:
        """Return when the bytes of an open file are on disk. Raises OSError."""

    def sync_folder(self, folder: Path) -> None:
        """Return when the names in a folder are on disk. Raises OSError."""


class SystemDisk:
    """The disks of this computer. Implements ``Disk``."""

    def sync(self, file: IO[bytes]) -> None:
        """See ``Disk``."""
        file.flush()
        os.fsync(file.fileno())

    def sync_folder(self, folder: Path) -> None:
        """See ``Disk``."""
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


SYSTEM_DISK = SystemDisk()


def _disk_of(path: Path) -> Disk:
    disk: Disk = getattr(path, "disk", SYSTEM_DISK)
    return disk


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A file to write; at the end it takes the place of ``path`` as a whole, or not at all.

    It is made under a name that nobody can guess and opened only if it is new, so that no link
    put there is followed. Raises OSError.
    """
    disk = _disk_of(path)
    make_folder(path.parent)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(8)}.part")
    try:
        with temporary.open("xb") as file:
            yield file
            disk.sync(file)
        temporary.replace(path)
        disk.sync_folder(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def appending(path: Path) -> Iterator[IO[bytes]]:
    """A file to read, cut and write at its end, unbuffered; made if there is none. Raises OSError.

    What is cut off while it is written leaves a part of it: the reader has to tell.
    """
    disk, new = _disk_of(path), not path.exists()
    make_folder(path.parent)
    with path.open("a+b", buffering=0) as file:
        yield file
        disk.sync(file)
    if new:
        disk.sync_folder(path.parent)


def sync(path: Path, file: IO[bytes]) -> None:
    """Return when the bytes of an open file for this path are on disk. Raises OSError."""
    _disk_of(path).sync(file)


def make_folder(folder: Path) -> None:
    """Make a folder and those above it, where they are missing. Raises OSError."""
    if not folder.exists():
        make_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        _disk_of(folder).sync_folder(folder.parent)


def remove(path: Path) -> None:
    """Remove a file, if there is one. Raises OSError."""
    path.unlink(missing_ok=True)
    if path.parent.exists():
        _disk_of(path).sync_folder(path.parent)


def move(path: Path, to: Path) -> None:
    """Give a file another name, which is free or another file's. Raises OSError."""
    path.rename(to)
    for folder in dict.fromkeys((to.parent, path.parent)):
        _disk_of(path).sync_folder(folder)


def sweep_leftovers(folder: Path) -> int:
    """Remove what writes that were cut off left in a folder; returns how many. Raises OSError."""
    leftovers = list(folder.glob(LEFTOVERS))
    for path in leftovers:
        remove(path)
    return len(leftovers)
