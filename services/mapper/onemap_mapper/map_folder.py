"""The saved maps of a folder: listed and deleted."""
# Touches files: maps.

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from onemap_mapper.storage.map_file import SUFFIX, map_path, read_header, require
from onemap_mapper.storage.snapshot import MapFileError
from onemap_shared.messages import MAX_FILE_TEXT_CHARS, MAX_LISTED_MAPS, MapList, SavedMap


class QuotaExceeded(ValueError):
    """The saved maps would take more than they may; the text says what to do."""


def check_quota(path: Path, nbytes: int, quota_mb: int) -> None:
    """Raise ``QuotaExceeded`` if a file of about ``nbytes`` at ``path`` is too much.

    A file that it replaces does not count.
    """
    others = (each for each in path.parent.glob(f"*{SUFFIX}") if each != path)
    used = sum(_size(each) for each in others) + nbytes
    if used > quota_mb * 10**6:
        raise QuotaExceeded(
            f"the saved maps would take {used / 1e6:.0f} MB, more than map_quota_mb, {quota_mb}: "
            "delete one, GET /v1/maps lists them"
        )


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:  # deleted meanwhile
        return 0


def saved_maps(folder: Path) -> MapList:
    """The maps of ``folder``, newest first; a damaged one is listed with its problem."""
    found: list[tuple[int, Path]] = []
    for path in folder.glob(f"*{SUFFIX}"):
        with suppress(FileNotFoundError, MapFileError):  # deleted meanwhile; no name of a map
            if map_path(folder, path.name).is_file():
                found.append((-path.stat().st_mtime_ns, path))
    maps = []
    for _, path in sorted(found)[:MAX_LISTED_MAPS]:
        with suppress(FileNotFoundError):
            maps.append(describe(path))
    return MapList(tuple(maps), max(len(found) - MAX_LISTED_MAPS, 0))


def saved_map(folder: Path, name: str) -> SavedMap:
    """The map of this name; raises ``MapNotFound``, or ``MapFileError`` for another name."""
    path = map_path(folder, name)
    require(path)
    return describe(path)


def delete(folder: Path, name: str) -> SavedMap:
    """Delete the file of this name; returns what it was. Raises as ``saved_map``, and OSError."""
    described = saved_map(folder, name)
    map_path(folder, name).unlink()
    return described


def describe(path: Path) -> SavedMap:
    """What is known of a file without reading its arrays."""
    entry = path.stat()
    stem = path.name.removesuffix(SUFFIX)
    name = path.name if stem.endswith(SUFFIX) else stem  # "x" for x.npz, not "x.npz" for x.npz.npz
    try:
        header, cells = read_header(path)
        return SavedMap(
            name,
            entry.st_size,
            entry.st_mtime_ns,
            encoder_id=header.encoder_id,
            text_space=header.text_space,
            cell_size_m=header.cell_size_m,
            cells_observed=cells,
            frames_fused=header.frames_fused,
        )
    except ValueError as problem:  # of the file, or of a text that is too long for the message
        reason = str(problem)[:MAX_FILE_TEXT_CHARS]
        return SavedMap(name, entry.st_size, entry.st_mtime_ns, problem=reason)
