"""Maps on disk: one .npz file without pickle, described in docs/formats.md.

A file that does not fit is rejected with one sentence, and nothing has changed: one of 13 MB can
claim arrays of gigabytes, by compression, by shapes without data, or by numbers that no message
holds, so that all it says is compared with its size and the largest map before an array is read.

The map in use is written while frames are fused: features, nearly all of a map, go to the file part
by part, so that writing takes the memory of one part, and fusing waits for one part only. Those of
a file that is read stay there, as a memory map whose pages the system may drop.
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
from math import prod
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
    VERSION_WITHOUT_DROPS,
    MapFileError,
    MapHeader,
    MapSnapshot,
    outline,
    take,
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
MAX_KEPT_BYTES = 2**27  # of the found objects: 200 pictures of 256 kB and their texts
MAX_CONFIDENCE = 1e30  # sums of it stay finite in float32
MAX_HEIGHT_SHARE = 1.1  # 1, with what rounding leaves; more where an older release moved it


@dataclass(frozen=True, slots=True)
class Declared:
    """An array as the file declares it, before its data are read.

    stored_bytes: of data in the archive; compressed: whether they are packed there.
    """

    dtype: str
    shape: tuple[int, ...]
    stored_bytes: int
    compressed: bool

    @property
    def nbytes(self) -> int:
        return prod(self.shape) * np.dtype(self.dtype).itemsize


HEADERS = TypeAdapter(MapHeader)
# The arrays of a map of n cells, m of them with evidence of obstacles: dtypes and shape of each.
FORMS: dict[str, tuple[tuple[str, ...], tuple[str | int, ...]]] = {
    "cells": (("int32",), ("n", 2)),
    "features": (("float16", "float32"), ("n", "D")),
    "confidence": (("float32",), ("n",)),
    "searched": (("float32",), ("n",)),
    "driving_cells": (("int32",), ("m", 2)),
    "evidence": (("int8",), ("m", "levels")),
    "clear": (("uint8",), ("m",)),
    "explored": (("float32",), ("n",)),
    "heights": (("float32",), ("n", LEVELS)),
    "colours": (("uint8",), ("n", 3)),
    "view_poses": (("float64",), ("views", 3)),
    "best_view": (("int32",), ("n",)),
    "view_confidence": (("float32",), ("n",)),
    "last_seen_ns": (("int64",), ("n",)),
}
# Arrays that files of earlier releases do not have; earlier releases leave them unread.
SEEN = ("view_poses", "best_view", "view_confidence", "last_seen_ns")  # all of them, or none
ADDED = ("explored", "heights", "colours", *SEEN)
ARRAYS = tuple(name for name in FORMS if name not in ADDED)


def _checked(raw: object, name: str) -> MapHeader:
    """The header of a map that can be read; MapFileError for another."""
    if not isinstance(raw, dict) or raw.get("format") != FORMAT:
        raise MapFileError(f"{name} is not a map of OneMap")
    if raw.get("version") not in (VERSION_WITHOUT_DROPS, VERSION):
        raise MapFileError(
            f"{name} has format version {str(raw.get('version'))[:40]}; this program reads "
            f"{VERSION_WITHOUT_DROPS} and {VERSION}"
        )
    try:
        header = HEADERS.validate_json(json.dumps(raw), strict=True)
    except ValidationError as problem:
        first = problem.errors()[0]
        field = first["loc"][0] if first["loc"] else "its header"
        raise MapFileError(f"{name} is damaged: {field}: {first['msg']}") from problem
    if header.dimension and not (header.encoder_id and header.text_space):
        raise MapFileError(f"{name} is damaged: it does not say which encoder made its features")
    return header


def check_arrays(
    declared: Mapping[str, Declared], header: MapHeader, name: str, max_cells: int
) -> None:
    """Raise ``MapFileError`` unless the arrays fit together, into the file and into a map."""
    for part, array in declared.items():
        if array.compressed:
            raise MapFileError(f"{name} is damaged: {part} is compressed; maps are not compressed")
        if array.nbytes > array.stored_bytes:
            raise MapFileError(
                f"{name} is damaged: {part} takes {array.nbytes} bytes, but the file holds "
                f"{array.stored_bytes}"
            )
    n, m = (max(declared[name].shape[:1], default=0) for name in ("cells", "driving_cells"))
    if max(n, m) > max_cells:
        raise MapFileError(
            f"{name} has {max(n, m)} cells; max_extent_m and cell_size_m allow {max_cells}"
        )
    levels = max(declared["evidence"].shape[1:], default=0)
    if levels > MAX_LEVELS:
        raise MapFileError(f"{name} is damaged: columns of {levels} levels")
    poses = declared.get("view_poses")
    views = min(*poses.shape[:1], n) if poses else 0  # each is the best one of some cell
    sizes = {"n": n, "m": m, "D": header.dimension, "levels": levels, "views": views}
    for part, array in declared.items():
        dtypes, axes = FORMS[part]
        shape = tuple(sizes[axis] if isinstance(axis, str) else axis for axis in axes)
        if array.dtype not in dtypes or array.shape != shape:
            raise MapFileError(
                f"{name} is damaged: {part} is {array.dtype} {array.shape}, expected "
                f"{' or '.join(dtypes)} {shape}"
            )


def _impossible(snapshot: MapSnapshot) -> Iterator[str]:
    """Which values of a map, besides features, no map can hold."""
    amounts = {name: getattr(snapshot, name) for name in ("confidence", "searched", "explored")}
    seen = snapshot.seen
    if seen is not None:
        if not (np.abs(seen.poses) <= MAX_COORDINATE_M).all():  # also refuses NaN
            yield "views from places that no map has"
        if seen.best.size and not -1 <= seen.best.min() <= seen.best.max() < len(seen.poses):
            yield "cells with views that are not there"
        if seen.last_seen_ns.min(initial=0) < 0:
            yield "times before 1970"
        amounts["view_confidence"] = seen.confidence
    for name, values in amounts.items():
        if values is not None and not ((values >= 0) & (values <= MAX_CONFIDENCE)).all():
            yield f"{name} outside of 0 to {MAX_CONFIDENCE:g}"
    heights, evidence = snapshot.known_heights(), snapshot.evidence
    if not ((heights >= 0) & (heights <= MAX_HEIGHT_SHARE)).all():
        yield f"shares of height outside of 0 to {MAX_HEIGHT_SHARE:g}"
    if evidence.size and not (evidence.min() >= MIN_EVIDENCE and evidence.max() <= MAX_EVIDENCE):
        yield f"evidence outside of {MIN_EVIDENCE} to {MAX_EVIDENCE}"
    if snapshot.clear.size and snapshot.clear.max() > ASSUMED:
        yield f"clear that is none of 0 to {ASSUMED}"
    for name in ("cells", "driving_cells"):
        cells = getattr(snapshot, name)
        if len(np.unique(cells, axis=0)) != len(cells):
            yield f"{name} that are there twice"


SUFFIX = ".npz"
NAME = re.compile(r"[A-Za-z0-9._-]+")
HEADER, FEATURES, MEMBER = "header", "features", ".npy"
LOCAL_HEADER = 30  # bytes before the name of an entry of a zip file
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
        if problem := next(_impossible(snapshot), ""):
            raise _unreadable(problem)
        for name, array in _arrays(snapshot).items():
            add(name, array)
    return path.stat().st_size


def _arrays(snapshot: MapSnapshot) -> dict[str, NDArray]:
    names = [name for name in FORMS if name != FEATURES and name not in SEEN]
    arrays = {name: getattr(snapshot, name) for name in names}
    if snapshot.objects.objects:
        arrays[OBJECTS] = np.frombuffer(to_bytes(snapshot.objects), np.uint8)
    if snapshot.places:
        kept = memory.to_bytes(memory.PlaceMemory(snapshot.places))
        arrays[PLACES] = np.frombuffer(kept, np.uint8)
    if (seen := snapshot.seen) is not None:
        parts = (seen.poses, seen.best, seen.confidence, seen.last_seen_ns)
        arrays |= dict(zip(SEEN, parts, strict=True))
    return {name: array for name, array in arrays.items() if array is not None}


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

    Nothing is read that is larger than a map of ``max_cells`` or than the file.
    """
    require(path)
    with _opened(path) as archive:
        header = _header(archive, path)
        declared = {name: _declared(archive, name) for name in _names(archive)}
        check_arrays(declared, header, path.name, max_cells)
        arrays = {name: archive[name] for name in _names(archive) if name != FEATURES}
        arrays[FEATURES], finite = _features(archive, path)
        objects = from_bytes(_bytes(archive, OBJECTS)) if OBJECTS in archive else NO_OBJECTS
        places = memory.NO_PLACES
        if PLACES in archive:
            places = memory.from_bytes(_bytes(archive, PLACES))
        seen = [arrays.pop(name) for name in SEEN if name in arrays]
        snapshot = MapSnapshot(
            header,
            **arrays,
            objects=objects,
            places=places.places,
            seen=SeenFrom(*seen) if seen else None,
        )
        problem = next(_impossible(snapshot), "") if finite else NOT_FINITE
    if problem:
        raise MapFileError(f"{path.name} is damaged: it holds {problem}")
    return snapshot


def read_header(path: Path) -> tuple[MapHeader, int]:
    """The checked header of a file and the number of its cells; its arrays are not read."""
    with _opened(path) as archive:
        header = _header(archive, path)
        return header, _declared(archive, "cells").shape[0]


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
    declared = _declared(archive, HEADER)
    if max(stored, declared.nbytes) > MAX_HEADER_BYTES:
        raise MapFileError(f"{path.name} is damaged: its header has {stored} bytes")
    return _checked(json.loads(str(archive[HEADER])), path.name)


def _names(archive: Any) -> tuple[str, ...]:
    return (*ARRAYS, *(name for name in ADDED if name in archive))


def _features(archive: Any, path: Path) -> tuple[NDArray, bool]:
    """The features (n, D) of a file, mapped into memory, and whether they are finite.

    They are read once, part by part, which also compares their checksum.
    """
    entry, finite = archive.zip.getinfo(FEATURES + MEMBER), True
    with archive.zip.open(entry) as file:
        shape, by_columns, dtype = _start(file)
        if by_columns or 0 in shape:
            features: NDArray = archive[FEATURES]
            return features, bool(np.isfinite(features).all())
        first = file.tell()
        while data := file.read(PART * shape[1] * dtype.itemsize):
            finite = finite and bool(np.isfinite(np.frombuffer(data, dtype)).all())
    with path.open("rb") as raw:
        raw.seek(entry.header_offset + LOCAL_HEADER - 4)
        name_and_extra = struct.unpack("<HH", raw.read(4))
        first += raw.tell() + sum(name_and_extra)
        # "c": what is written to them, as nothing does, would not reach the file.
        return np.memmap(raw, dtype, "c", first, shape), finite


def _start(file: Any) -> tuple[tuple[int, ...], bool, np.dtype]:
    """Shape, whether in Fortran's order, and dtype of an array, from its first bytes."""
    version = np.lib.format.read_magic(file)
    return {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }[version](file)


def _declared(archive: Any, name: str) -> Declared:
    """Type and shape of an array from the first bytes of its entry."""
    entry = archive.zip.getinfo(name + MEMBER)
    with archive.zip.open(entry) as file:
        shape, _, dtype = _start(file)
        compressed = entry.compress_type != zipfile.ZIP_STORED
        return Declared(str(dtype), shape, entry.file_size - file.tell(), compressed)


def _bytes(archive: Any, name: str) -> bytes:
    declared = _declared(archive, name)
    if declared.compressed or declared.nbytes > MAX_KEPT_BYTES:
        raise ValueError(f"its {name} take {declared.nbytes} bytes")
    data: bytes = archive[name].tobytes()
    return data


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

    def whole(self) -> tuple[MapSnapshot, int]:
        """A copy of one whole revision, and its number; frames wait for it."""
        with self.lock:
            belief = self.current()
            return take(belief), belief.revision

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
