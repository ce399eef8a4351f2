"""Maps on disk: one .npz file without pickle, described in docs/formats.md.

A file is written under a temporary name and renamed, so a crash leaves the previous one. A file
that does not fit is rejected with one sentence, and nothing has changed.
"""

from __future__ import annotations

import json
import os
import re
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from onemap_mapper.objects import NO_OBJECTS, from_bytes, to_bytes
from onemap_mapper.snapshot import (
    FORMAT,
    VERSION,
    VERSION_WITHOUT_DROPS,
    MapFileError,
    MapHeader,
    MapSnapshot,
)

SUFFIX = ".npz"
NAME = re.compile(r"[A-Za-z0-9._-]+")
UNREADABLE = (OSError, EOFError, KeyError, ValueError, TypeError, zipfile.BadZipFile, zlib.error)
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
EXPLORED = "explored"  # not in files of releases that counted all frames


class MapNotFound(MapFileError):
    """There is no file with this name."""


def map_path(folder: Path, name: str) -> Path:
    """The path of a map's file, always directly inside ``folder``."""
    if not NAME.fullmatch(name) or name.startswith("."):
        raise MapFileError(
            f"map name {name[:80]!r} is not allowed: use letters, digits, dot, dash, underscore"
        )
    return folder / (name if name.endswith(SUFFIX) else name + SUFFIX)


def write(snapshot: MapSnapshot, path: Path) -> int:
    """Write the file atomically; returns its size in bytes. Raises OSError, MapFileError."""
    if not _is_finite(snapshot):
        raise MapFileError(
            "the map in memory holds values that are not finite, so no file of it could be read: "
            "clear it"
        )
    arrays = {name: getattr(snapshot, name) for name in ARRAYS}
    if snapshot.objects.objects:
        arrays[OBJECTS] = np.frombuffer(to_bytes(snapshot.objects), np.uint8)
    if snapshot.explored is not None:
        arrays[EXPLORED] = snapshot.explored
    with replacing(path) as file:
        np.savez(file, header=np.array(json.dumps(asdict(snapshot.header))), **arrays)
    return path.stat().st_size


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A file to write; at the end it takes the place of ``path`` as a whole, or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with temporary.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def read(path: Path) -> MapSnapshot:
    """The checked content of a file; raises ``MapNotFound`` or another ``MapFileError``."""
    require(path)
    with _opened(path) as archive:
        header = _header(archive, path)
        arrays = {name: archive[name] for name in ARRAYS}
        objects = from_bytes(archive[OBJECTS].tobytes()) if OBJECTS in archive else NO_OBJECTS
        explored = archive.get(EXPLORED, None)
        snapshot = MapSnapshot(header, **arrays, objects=objects, explored=explored)
    _check_arrays(snapshot, path)
    return snapshot


def read_header(path: Path) -> tuple[MapHeader, int]:
    """The checked header of a file and the number of its cells; its arrays are not read."""
    with _opened(path) as archive:
        header = _header(archive, path)
        with archive.zip.open("cells.npy") as file:
            np.lib.format.read_magic(file)
            (count, _), _, _ = np.lib.format.read_array_header_1_0(file)
    return header, int(count)


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
        with np.load(path, allow_pickle=False) as archive:
            yield archive
    except MapFileError:
        raise
    except UNREADABLE as problem:
        raise MapFileError(f"{path.name} is damaged or not a map: {problem}") from problem


def _header(archive: Any, path: Path) -> MapHeader:
    raw = json.loads(str(archive["header"]))
    _check_identity(raw, path)
    header = MapHeader(**raw)
    _check_types(header, path)
    return header


def _check_identity(raw: Any, path: Path) -> None:
    if not isinstance(raw, dict) or raw.get("format") != FORMAT:
        raise MapFileError(f"{path.name} is not a map of OneMap")
    if raw.get("version") not in (VERSION_WITHOUT_DROPS, VERSION):
        raise MapFileError(
            f"{path.name} has format version {raw.get('version')}; this program reads "
            f"{VERSION_WITHOUT_DROPS} and {VERSION}"
        )


def _check_types(header: MapHeader, path: Path) -> None:
    for field in fields(MapHeader):
        value = getattr(header, field.name)
        fits = {
            "str": isinstance(value, str),
            "int": isinstance(value, int) and value >= 0,
            "float": isinstance(value, float),
        }
        if not fits[str(field.type)]:
            raise MapFileError(f"{path.name} is damaged: {field.name} is {value!r}")


def _check_arrays(snapshot: MapSnapshot, path: Path) -> None:
    n, m = len(snapshot.cells), len(snapshot.driving_cells)
    half = snapshot.features.dtype == np.float16
    layout: dict[str, tuple[str, tuple[int, ...]]] = {
        "cells": ("int32", (n, 2)),
        "features": ("float16" if half else "float32", (n, snapshot.header.dimension)),
        "confidence": ("float32", (n,)),
        "searched": ("float32", (n,)),
        "driving_cells": ("int32", (m, 2)),
        "evidence": ("int8", (m, *snapshot.evidence.shape[-1:])),
        "clear": ("uint8", (m,)),
    }
    if snapshot.explored is not None:
        layout[EXPLORED] = ("float32", (n,))
    for name, (dtype, shape) in layout.items():
        array = getattr(snapshot, name)
        if str(array.dtype) != dtype or array.shape != shape:
            raise MapFileError(
                f"{path.name} is damaged: {name} is {array.dtype} {array.shape}, "
                f"expected {dtype} {shape}"
            )
    distinct = len(np.unique(snapshot.cells, axis=0)) == n
    if not (_is_finite(snapshot) and distinct and (snapshot.confidence >= 0).all()):
        raise MapFileError(f"{path.name} is damaged: it holds values that no map can hold")


def _is_finite(snapshot: MapSnapshot) -> bool:
    arrays = (snapshot.features, snapshot.confidence, snapshot.searched, snapshot.explored)
    return all(array is None or bool(np.isfinite(array).all()) for array in arrays)
