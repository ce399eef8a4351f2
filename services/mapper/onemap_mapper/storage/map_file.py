"""Maps on disk: one .npz file without pickle, described in docs/formats.md.

A file that does not fit is rejected with one sentence, and nothing has changed. Nothing in it is
compressed, so that reading takes no more memory than the file has bytes.

The map in use is written while frames are fused: features, nearly all of a map, go to the file part
by part, so that writing takes the memory of one part, and fusing waits for one part only.
"""

from __future__ import annotations

import json
import re
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, dataclass, replace
from math import inf, prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.npyio import NpzFile
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.view_log import SeenFrom
from onemap_mapper.occupancy.evidence import MAX_EVIDENCE, MIN_EVIDENCE
from onemap_mapper.occupancy.heights import LEVELS
from onemap_mapper.places import memory
from onemap_mapper.query.regions import Extent, extent_band
from onemap_mapper.storage.objects import NO_OBJECTS, ObjectMemory, from_bytes, to_bytes
from onemap_mapper.storage.snapshot import (
    ASSUMED,
    FORMAT,
    VERSION,
    MapFileError,
    MapHeader,
    MapSnapshot,
    outline,
)
from onemap_mapper.transfers import to_host
from onemap_shared.atomic_file import replacing
from onemap_shared.geometry import MAX_COORDINATE_M
from onemap_shared.grid import MAX_CELLS
from onemap_shared.messages import Place


def _add(
    archive: zipfile.ZipFile,
    name: str,
    parts: Iterable[NDArray],
    shape: tuple[int, ...],
    dtype: np.dtype,
) -> None:
    """Write an array from its parts along the first axis.

    As ``numpy.savez`` does it, but it need never be in memory as a whole.
    """
    start = {"shape": shape, "fortran_order": False, "descr": dtype.str}
    written = 0
    with archive.open(name + MEMBER, "w", force_zip64=True) as entry:
        np.lib.format.write_array_header_1_0(entry, start)
        for part in parts:
            if part.dtype != dtype:
                raise ValueError(f"{name} is {dtype}, but a part of it is {part.dtype}")
            entry.write(np.ascontiguousarray(part).data)
            written += part.size
    if written != prod(shape):
        raise ValueError(f"{name} is {shape}, but its parts hold {written} values")


MAX_HEADER_BYTES = 64_000  # of the array with the JSON: ours have 2 kB
MAX_LEVELS = 1_000  # of a column: 11 at the default cell size
MAX_CONFIDENCE = 1e30  # sums of it stay finite in float32
MAX_HEIGHT_SHARE = 1.1  # 1, with what rounding leaves; more where an older release moved it


HEADERS = TypeAdapter(MapHeader)


@dataclass(frozen=True, slots=True)
class ArrayForm:
    """An array of a map: its dtypes, its shape, and the least and the largest value."""

    dtypes: tuple[str, ...]
    shape: tuple[str | int, ...]
    low: float = -inf
    high: float = inf


# The arrays of a map of n cells, m of them with evidence of obstacles, seen from k views.
FORMS = {
    "cells": ArrayForm(("int32",), ("n", 2)),
    "features": ArrayForm(("float16", "float32"), ("n", "D")),
    "confidence": ArrayForm(("float32",), ("n",), 0, MAX_CONFIDENCE),
    "searched": ArrayForm(("float32",), ("n",), 0, MAX_CONFIDENCE),
    "driving_cells": ArrayForm(("int32",), ("m", 2)),
    "evidence": ArrayForm(("int8",), ("m", "levels"), MIN_EVIDENCE, MAX_EVIDENCE),
    "clear": ArrayForm(("uint8",), ("m",), 0, ASSUMED),
    "explored": ArrayForm(("float32",), ("n",), 0, MAX_CONFIDENCE),
    "heights": ArrayForm(("float32",), ("n", LEVELS), 0, MAX_HEIGHT_SHARE),
    "colours": ArrayForm(("uint8",), ("n", 3)),
    "view_poses": ArrayForm(("float64",), ("k", 3), -MAX_COORDINATE_M, MAX_COORDINATE_M),
    "best_view": ArrayForm(("int32",), ("n",), -1),
    "view_confidence": ArrayForm(("float32",), ("n",), 0, MAX_CONFIDENCE),
    "last_seen_ns": ArrayForm(("int64",), ("n",), 0),
}
SEEN = ("view_poses", "best_view", "view_confidence", "last_seen_ns")
COLOURS = "colours"  # files of 0.1.0 do not have them


def _checked(raw: object, name: str) -> MapHeader:
    """The header of a map that can be read; MapFileError for another."""
    if not isinstance(raw, dict) or raw.get("format") != FORMAT:
        raise MapFileError(f"{name} is not a map of OneMap")
    if raw.get("version") != VERSION:
        version = str(raw.get("version"))[:40]
        raise MapFileError(f"{name} has format version {version}; this program reads {VERSION}")
    try:
        header = HEADERS.validate_json(json.dumps(raw), strict=True)
    except ValidationError as problem:
        first = problem.errors()[0]
        field = first["loc"][0] if first["loc"] else "its header"
        raise MapFileError(f"{name} is damaged: {field}: {first['msg']}") from problem
    if header.dimension and not (header.encoder_id and header.text_space):
        raise MapFileError(f"{name} is damaged: it does not say which encoder made its features")
    return header


def _check_arrays(
    arrays: Mapping[str, NDArray], header: MapHeader, name: str, max_cells: int
) -> None:
    """Raise ``MapFileError`` unless the arrays fit together and into a map."""
    n, m = len(arrays["cells"]), len(arrays["driving_cells"])
    if max(n, m) > max_cells:
        raise MapFileError(
            f"{name} has {max(n, m)} cells; max_extent_m and cell_size_m allow {max_cells}"
        )
    levels = max(arrays["evidence"].shape[1:], default=0)
    if levels > MAX_LEVELS:
        raise MapFileError(f"{name} is damaged: columns of {levels} levels")
    views = min(len(arrays["view_poses"]), n)  # each is the best one of some cell
    sizes = {"n": n, "m": m, "D": header.dimension, "levels": levels, "k": views}
    for part, array in arrays.items():
        form = FORMS[part]
        shape = tuple(sizes[axis] if isinstance(axis, str) else axis for axis in form.shape)
        if str(array.dtype) not in form.dtypes or array.shape != shape:
            raise MapFileError(
                f"{name} is damaged: {part} is {array.dtype} {array.shape}, expected "
                f"{' or '.join(form.dtypes)} {shape}"
            )


def _impossible(arrays: Mapping[str, NDArray]) -> Iterator[str]:
    """Which values no map can hold."""
    if not np.isfinite(arrays[FEATURES].sum(dtype=np.float64)):
        yield NOT_FINITE
    for name, form in FORMS.items():
        if form.low == -inf:
            continue
        values = arrays[name]
        if not ((values >= form.low) & (values <= form.high)).all():  # also of NaN
            yield f"{name} outside of {form.low:g} to {form.high:g}"
    if arrays["best_view"].max(initial=-1) >= len(arrays["view_poses"]):
        yield "cells with views that are not there"
    for name in ("cells", "driving_cells"):
        if len(np.unique(arrays[name], axis=0)) != len(arrays[name]):
            yield f"{name} that are there twice"


SUFFIX = ".npz"
NAME = re.compile(r"[A-Za-z0-9._-]+")
HEADER, FEATURES, MEMBER = "header", "features", ".npy"
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
OBJECTS, PLACES = "objects", "places"  # only in files of maps with found objects, named places
NOT_FINITE = "features that are not finite"


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
    header = asdict(snapshot.header)
    _checked(header, "the map in memory")
    with replacing(path) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:

        def add(name: str, array: NDArray) -> None:
            _add(archive, name, [array], array.shape, array.dtype)

        add(HEADER, np.array(json.dumps(header)))
        shape = (len(snapshot.cells), snapshot.header.dimension)
        parts = [snapshot.features] if feature_parts is None else feature_parts
        _add(archive, "features", map(_finite, parts), shape, snapshot.features.dtype)
        arrays = _arrays(snapshot)
        if problem := next(_impossible(arrays | {FEATURES: snapshot.features}), ""):
            raise _unreadable(problem)
        for name, array in (arrays | _memories(snapshot)).items():
            add(name, array)
    return path.stat().st_size


def _arrays(snapshot: MapSnapshot) -> dict[str, NDArray]:
    """All but the features."""
    names = [name for name in FORMS if name != FEATURES and name not in SEEN]
    arrays = {name: getattr(snapshot, name) for name in names}
    seen = snapshot.seen
    arrays |= zip(SEEN, (seen.poses, seen.best, seen.confidence, seen.last_seen_ns), strict=True)
    return {name: array for name, array in arrays.items() if array is not None}


def _memories(snapshot: MapSnapshot) -> dict[str, NDArray]:
    """Objects and places, if there are any."""
    arrays: dict[str, NDArray] = {}
    if snapshot.objects.objects:
        arrays[OBJECTS] = np.frombuffer(to_bytes(snapshot.objects), np.uint8)
    if snapshot.places:
        kept = memory.to_bytes(memory.PlaceMemory(snapshot.places))
        arrays[PLACES] = np.frombuffer(kept, np.uint8)
    return arrays


def _finite(features: NDArray) -> NDArray:
    if not np.isfinite(features).all():
        raise _unreadable(NOT_FINITE)
    return features


def _unreadable(problem: str) -> MapFileError:
    return MapFileError(
        f"the map in memory holds {problem}, so no file of it could be read: clear it"
    )


def read(path: Path, *, max_cells: int = MAX_CELLS) -> MapSnapshot:
    """The checked content of a file; raises ``MapNotFound`` or another ``MapFileError``.

    max_cells: of the largest map.
    """
    require(path)
    with _opened(path) as archive:
        header = _header(archive, path)
        arrays = {name: archive[name] for name in FORMS if name != COLOURS or name in archive}
        _check_arrays(arrays, header, path.name, max_cells)
        problem = next(_impossible(arrays), "")
        objects, places = NO_OBJECTS, memory.NO_PLACES
        if OBJECTS in archive:
            objects = from_bytes(archive[OBJECTS].tobytes())
        if PLACES in archive:
            places = memory.from_bytes(archive[PLACES].tobytes())
    if problem:
        raise MapFileError(f"{path.name} is damaged: it holds {problem}")
    seen = SeenFrom(*(arrays.pop(name) for name in SEEN))
    return MapSnapshot(header, **arrays, objects=objects, places=places.places, seen=seen)


def read_header(path: Path) -> tuple[MapHeader, int]:
    """The checked header of a file and the number of its cells; no other array is read."""
    with _opened(path) as archive:
        return _header(archive, path), len(archive["cells"])


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
            entries = archive.zip.infolist()
            packed = any(entry.compress_type != zipfile.ZIP_STORED for entry in entries)
            if packed or sum(entry.file_size for entry in entries) > path.stat().st_size:
                raise MapFileError(f"{path.name} is damaged: maps are not compressed")
            yield archive  # np.load would take a single array too
    except MapFileError:
        raise
    except UNREADABLE as problem:
        reason = str(problem)[:MAX_REASON_CHARS] or type(problem).__name__
        raise MapFileError(f"{path.name} is damaged or not a map: {reason}") from problem


def _header(archive: Any, path: Path) -> MapHeader:
    header = archive[HEADER]
    if header.nbytes > MAX_HEADER_BYTES:
        raise MapFileError(f"{path.name} is damaged: its header has {header.nbytes} bytes")
    return _checked(json.loads(str(header)), path.name)


PART = 512  # cells that are copied at a time: 1.5 MB of 768 float32 channels, under 1 ms


class MapReplaced(Exception):
    """Another map took the place of the one that is written."""


@dataclass(frozen=True, slots=True)
class LiveMap:
    """The map of a mapper. ``current`` gives it; it changes only while ``lock`` is held."""

    lock: AbstractContextManager[object]
    current: Callable[[], BeliefMap]

    def write(
        self,
        path: Path,
        *,
        objects: ObjectMemory = NO_OBJECTS,
        places: tuple[Place, ...] = (),
        accept: Callable[[int], None] = lambda _nbytes: None,
    ) -> int:
        """Write the file atomically; returns its size in bytes, 0 and no file of an empty map.

        A cell's feature and confidences are of one moment; two cells may be some frames apart.
        If another map takes the place meanwhile, it begins again. ``accept`` is given about how
        many bytes it will be, and may raise. Raises OSError, MapFileError.
        """
        while True:
            with self.lock:
                belief = self.current()
                content = replace(outline(belief), objects=objects, places=places)
            if not content.header.dimension:
                return 0
            accept(content.nbytes)
            try:
                return write(content, path, self._feature_parts(belief, content))
            except MapReplaced:
                continue

    def height_m(self, extent_m: Extent) -> tuple[float, ...]:
        """Lowest and highest height, metres, of what lies there; empty: nothing is known of it."""
        with self.lock:
            return extent_band(self.current().shared_version(), extent_m)

    def _feature_parts(self, belief: BeliefMap, content: MapSnapshot) -> Iterator[NDArray]:
        """All features in parts, each valid until the next is asked for.

        Sets the confidences of ``content`` to those of the same moment. There is one buffer for
        all parts, because torch's allocations, which are aligned, leave gaps behind.
        Raises ``MapReplaced`` if it is not the map in use any more.
        """
        store, count = belief.store, len(content.cells)
        buffer = np.empty((min(PART, count), belief.dimension), content.features.dtype)
        for first in range(0, count, PART):
            part = slice(first, min(first + PART, count))
            with self.lock:
                if belief is not self.current():
                    raise MapReplaced
                for rows, features in store.chunks(np.arange(part.start, part.stop)):
                    buffer[rows] = to_host(features)
                confidences = store.confidences(part)
            copies = (content.confidence, content.searched, content.explored)
            for copy, values in zip(copies, confidences[: len(copies)], strict=True):
                if copy is not None:
                    copy[part] = values
            yield buffer[: part.stop - part.start]
