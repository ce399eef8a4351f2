"""Maps on disk: one .npz file without pickle, described in docs/formats.md.

A file is written under a temporary name and renamed, so a crash leaves the previous one. A file
that does not fit is rejected with one sentence, and nothing has changed.
"""

from __future__ import annotations

import json
import re
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.npyio import NpzFile
from numpy.typing import NDArray

from onemap_mapper import map_layout
from onemap_mapper.atomic_file import replacing
from onemap_mapper.npz_writer import NpzWriter
from onemap_mapper.objects import NO_OBJECTS, from_bytes, to_bytes
from onemap_mapper.snapshot import MapFileError, MapHeader, MapSnapshot
from onemap_mapper.view_log import SeenFrom
from onemap_shared.grid import MAX_CELLS

SUFFIX = ".npz"
NAME = re.compile(r"[A-Za-z0-9._-]+")
HEADER, MEMBER = "header", ".npy"
MAX_REASON_CHARS = 200
UNREADABLE = (  # what zipfile, NumPy, JSON and msgpack raise on files of any content
    ArithmeticError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    OSError,
    RuntimeError,  # also RecursionError and NotImplementedError
    SyntaxError,
    TypeError,
    ValueError,
    struct.error,
    tokenize.TokenError,  # of an array's header
    zipfile.BadZipFile,
    zlib.error,
)
ARRAYS = (
    "cells",
    "features",
    "confidence",
    "searched",
    "driving_cells",
    "evidence",
    "clear",
)
OBJECTS = "objects"  # only in files of maps with found objects
# Arrays that files of earlier releases do not have; earlier releases leave them unread.
EXPLORED = "explored"
HEIGHTS = "heights"
SEEN = ("view_poses", "best_view", "view_confidence", "last_seen_ns")  # all of them, or none
ADDED = (EXPLORED, HEIGHTS, *SEEN)


class MapNotFound(MapFileError):
    """There is no file with this name."""


def map_path(folder: Path, name: str) -> Path:
    """The path of a map's file, always directly inside ``folder``."""
    if not NAME.fullmatch(name) or name.startswith("."):
        raise MapFileError(
            f"map name {name[:80]!r} is not allowed: use letters, digits, dot, dash, underscore"
        )
    return folder / (name if name.endswith(SUFFIX) else name + SUFFIX)


def write(snapshot: MapSnapshot, path: Path, feature_parts: Iterable[NDArray] | None = None) -> int:
    """Write the file atomically; returns its size in bytes. Raises OSError, MapFileError.

    feature_parts: consecutive rows (k, D) of all features, where the snapshot has (0, D); its
    confidences are read after them.
    """
    map_layout.check_header(snapshot.header, "the map in memory")
    with replacing(path) as file, NpzWriter(file) as archive:
        archive.add(HEADER, np.array(json.dumps(asdict(snapshot.header))))
        shape = (len(snapshot.cells), snapshot.header.dimension)
        parts = [snapshot.features] if feature_parts is None else feature_parts
        archive.add_parts("features", shape, snapshot.features.dtype, map(_finite, parts))
        if problem := map_layout.values_problem(snapshot):
            raise _unreadable(problem)
        for name, array in _arrays(snapshot).items():
            archive.add(name, array)
    return path.stat().st_size


def _arrays(snapshot: MapSnapshot) -> dict[str, NDArray]:
    """The arrays of a file by name, without its features."""
    arrays = {name: getattr(snapshot, name) for name in ARRAYS if name != "features"}
    if snapshot.objects.objects:
        arrays[OBJECTS] = np.frombuffer(to_bytes(snapshot.objects), np.uint8)
    if snapshot.explored is not None:
        arrays[EXPLORED] = snapshot.explored
    if snapshot.heights is not None:
        arrays[HEIGHTS] = snapshot.heights
    if (seen := snapshot.seen) is not None:
        parts = (seen.poses, seen.best, seen.confidence, seen.last_seen_ns)
        arrays |= dict(zip(SEEN, parts, strict=True))
    return arrays


def _finite(features: NDArray) -> NDArray:
    if problem := map_layout.features_problem(features):
        raise _unreadable(problem)
    return features


def _unreadable(problem: str) -> MapFileError:
    return MapFileError(
        f"the map in memory holds {problem}, so no file of it could be read: clear it"
    )


def read(path: Path, *, max_cells: int = MAX_CELLS) -> MapSnapshot:
    """The checked content of a file; raises ``MapNotFound`` or another ``MapFileError``.

    Nothing is read that is larger than a map of ``max_cells`` or than the file.
    """
    require(path)
    with _opened(path) as archive:
        header = _header(archive, path)
        map_layout.check_arrays(_declared(archive), header, path.name, max_cells)
        arrays = {name: archive[name] for name in _names(archive)}
        objects = from_bytes(_object_bytes(archive)) if OBJECTS in archive else NO_OBJECTS
        seen = [arrays.pop(name) for name in SEEN if name in arrays]
        snapshot = MapSnapshot(
            header, **arrays, objects=objects, seen=SeenFrom(*seen) if seen else None
        )
        problem = map_layout.features_problem(snapshot.features)
        problem = problem or map_layout.values_problem(snapshot)
    if problem:
        raise MapFileError(f"{path.name} is damaged: it holds {problem}")
    return snapshot


def read_header(path: Path) -> tuple[MapHeader, int]:
    """The checked header of a file and the number of its cells; its arrays are not read."""
    with _opened(path) as archive:
        header = _header(archive, path)
        return header, _declared_array(archive, "cells").shape[0]


def require(path: Path) -> None:
    """Raise ``MapNotFound`` unless there is such a file."""
    if not path.is_file():
        raise MapNotFound(
            f"there is no map {path.name} in {path.parent} on the mapper's machine: save one with "
            "'onemap map save', or correct the name"
        )


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The archive of a file; what goes wrong with it becomes a ``MapFileError``."""
    try:
        with path.open("rb") as file, NpzFile(file, allow_pickle=False) as archive:
            yield archive  # np.load would read a single array at once, whatever its size
    except MapFileError:
        raise
    except UNREADABLE as problem:
        reason = str(problem)[:MAX_REASON_CHARS] or type(problem).__name__
        raise MapFileError(f"{path.name} is damaged or not a map: {reason}") from problem


def _header(archive: Any, path: Path) -> MapHeader:
    stored = archive.zip.getinfo(HEADER + MEMBER).file_size
    declared = _declared_array(archive, HEADER)
    if max(stored, declared.nbytes) > map_layout.MAX_HEADER_BYTES:
        raise MapFileError(f"{path.name} is damaged: its header has {stored} bytes")
    raw = json.loads(str(archive[HEADER]))
    map_layout.check_identity(raw, path.name)
    header = MapHeader(**raw)
    map_layout.check_header(header, path.name)
    return header


def _declared(archive: Any) -> dict[str, map_layout.Declared]:
    return {name: _declared_array(archive, name) for name in _names(archive)}


def _names(archive: Any) -> tuple[str, ...]:
    return (*ARRAYS, *(name for name in ADDED if name in archive))


def _declared_array(archive: Any, name: str) -> map_layout.Declared:
    """Type and shape of an array from the first bytes of its entry."""
    entry = archive.zip.getinfo(name + MEMBER)
    with archive.zip.open(entry) as file:
        version = np.lib.format.read_magic(file)
        read_start = {
            (1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0,
        }[version]
        shape, _, dtype = read_start(file)
        compressed = entry.compress_type != zipfile.ZIP_STORED
        return map_layout.Declared(str(dtype), shape, entry.file_size - file.tell(), compressed)


def _object_bytes(archive: Any) -> bytes:
    declared = _declared_array(archive, OBJECTS)
    if declared.compressed or declared.nbytes > map_layout.MAX_OBJECT_BYTES:
        raise ValueError(f"its objects take {declared.nbytes} bytes")
    data: bytes = archive[OBJECTS].tobytes()
    return data
