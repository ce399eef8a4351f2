"""The file of the found objects in the map folder, from which a restarted mapper reads them."""
# Touches files: found objects.

from __future__ import annotations

from pathlib import Path

from onemap_mapper.objects import NO_OBJECTS, ObjectMemory, from_bytes, to_bytes
from onemap_mapper.storage.map_file import replacing

FILE_NAME = "objects.bin"  # without the suffix of a map, so it is not listed as one
SET_ASIDE = "objects.bin.unreadable"


def write(folder: Path, memory: ObjectMemory) -> None:
    """Write the file atomically; without objects, delete it. Raises OSError."""
    path = folder / FILE_NAME
    if memory.objects:
        with replacing(path) as file:
            file.write(to_bytes(memory))
    else:
        path.unlink(missing_ok=True)


def read(folder: Path) -> tuple[ObjectMemory, str]:
    """The objects, and why there are none, in one sentence, if the file cannot be read.

    Such a file is set aside: renamed, so that the next write does not replace it.
    """
    path = folder / FILE_NAME
    try:
        return from_bytes(path.read_bytes()), ""
    except FileNotFoundError:
        return NO_OBJECTS, ""
    except (OSError, ValueError) as problem:
        return NO_OBJECTS, f"the found objects are lost: {problem}; {_set_aside(path)}"


def _set_aside(path: Path) -> str:
    try:
        path.replace(path.with_name(SET_ASIDE))
    except OSError as problem:
        return f"{path} cannot be renamed either: {problem.strerror}"
    return f"{path} is now {SET_ASIDE}"
