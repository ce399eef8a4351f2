"""What a map file says about itself, checked before its arrays are read.

A file of 13 MB can claim arrays of gigabytes: by compression, by shapes without data, or by
numbers that no message holds. Everything is compared with the size of the file and of the largest
map first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import prod

import numpy as np
from numpy.typing import NDArray

from onemap_mapper.heights import LEVELS
from onemap_mapper.occupancy import MAX_EVIDENCE, MIN_EVIDENCE
from onemap_mapper.snapshot import (
    ASSUMED,
    FORMAT,
    VERSION,
    VERSION_WITHOUT_DROPS,
    MapFileError,
    MapHeader,
    MapSnapshot,
)
from onemap_mapper.view_log import SeenFrom
from onemap_shared.geometry import MAX_COORDINATE_M
from onemap_shared.messages import MAX_FILE_TEXT_CHARS

MAX_HEADER_BYTES = 64_000  # of the array with the JSON: ours have 2 kB
MAX_DIMENSION = 16_384  # channels of a feature; encoders have up to 1536
MAX_LEVELS = 1_000  # of a column: 11 at the default cell size
MAX_OBJECT_BYTES = 2**27  # of the found objects: 200 pictures of 256 kB and their texts
MAX_CONFIDENCE = 1e30  # sums of it stay finite in float32
MAX_HEIGHT_SHARE = 1.1  # 1, with what rounding leaves after submaps moved


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
        """Bytes that the array takes in memory."""
        return prod(self.shape) * np.dtype(self.dtype).itemsize


def check_identity(raw: object, name: str) -> None:
    """Raise ``MapFileError`` unless a header is that of a map that can be read."""
    if not isinstance(raw, dict) or raw.get("format") != FORMAT:
        raise MapFileError(f"{name} is not a map of OneMap")
    if raw.get("version") not in (VERSION_WITHOUT_DROPS, VERSION):
        raise MapFileError(
            f"{name} has format version {str(raw.get('version'))[:40]}; this program reads "
            f"{VERSION_WITHOUT_DROPS} and {VERSION}"
        )


def check_header(header: MapHeader, name: str) -> None:
    """Raise ``MapFileError`` unless every field has its type and fits into a message."""
    for field in fields(MapHeader):
        value = getattr(header, field.name)
        fits = {
            "str": isinstance(value, str) and _fits_a_message(value),
            "int": type(value) is int and 0 <= value < 2**63,
            "float": isinstance(value, float) and 0 <= value < 1e6,
        }
        if not fits[str(field.type)]:
            raise MapFileError(f"{name} is damaged: {field.name} is {str(value)[:80]!a}")
    if header.dimension > MAX_DIMENSION:
        raise MapFileError(
            f"{name} has features of {header.dimension} channels; the limit is {MAX_DIMENSION}"
        )
    if header.dimension and not (header.encoder_id and header.text_space):
        raise MapFileError(f"{name} is damaged: it does not say which encoder made its features")


def _fits_a_message(text: str) -> bool:
    return len(text) <= MAX_FILE_TEXT_CHARS and text.isprintable()  # no lone surrogates either


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
    (n,), (m,) = declared["cells"].shape[:1] or (0,), declared["driving_cells"].shape[:1] or (0,)
    if max(n, m) > max_cells:
        raise MapFileError(
            f"{name} has {max(n, m)} cells; max_extent_m and cell_size_m allow {max_cells}"
        )
    for part, (dtype, shape) in _layout(declared, header, n, m).items():
        array = declared[part]
        if (array.dtype, array.shape) != (dtype, shape):
            raise MapFileError(
                f"{name} is damaged: {part} is {array.dtype} {array.shape}, expected {dtype} "
                f"{shape}"
            )
    if declared["evidence"].shape[1] > MAX_LEVELS:
        raise MapFileError(f"{name} is damaged: columns of {declared['evidence'].shape[1]} levels")


def _layout(
    declared: Mapping[str, Declared], header: MapHeader, n: int, m: int
) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Type and shape of each array of a map of n cells, and m with evidence of obstacles."""
    half = declared["features"].dtype == "float16"
    layout: dict[str, tuple[str, tuple[int, ...]]] = {
        "cells": ("int32", (n, 2)),
        "features": ("float16" if half else "float32", (n, header.dimension)),
        "confidence": ("float32", (n,)),
        "searched": ("float32", (n,)),
        "driving_cells": ("int32", (m, 2)),
        "evidence": ("int8", (m, *declared["evidence"].shape[-1:])),
        "clear": ("uint8", (m,)),
    }
    added: dict[str, tuple[str, tuple[int, ...]]] = {
        "explored": ("float32", (n,)),
        "heights": ("float32", (n, LEVELS)),
        "best_view": ("int32", (n,)),
        "view_confidence": ("float32", (n,)),
        "last_seen_ns": ("int64", (n,)),
    }
    layout |= {part: form for part, form in added.items() if part in declared}
    if "view_poses" in declared:
        views = min(*declared["view_poses"].shape[:1], n)  # each is the best one of some cell
        layout["view_poses"] = ("float64", (views, 3))
    return layout


def features_problem(features: NDArray) -> str:
    """Which features (k, D) no map can hold; empty if there are none."""
    return "" if np.isfinite(features).all() else "features that are not finite"


def values_problem(snapshot: MapSnapshot) -> str:
    """Which other values of a map no map can hold; empty if there are none."""
    for part in ("confidence", "searched", "explored"):
        values = getattr(snapshot, part)
        if (
            values is not None and not ((values >= 0) & (values <= MAX_CONFIDENCE)).all()
        ):  # also refuses NaN
            return f"{part} outside of 0 to {MAX_CONFIDENCE:g}"
    evidence = snapshot.evidence
    if evidence.size and not (evidence.min() >= MIN_EVIDENCE and evidence.max() <= MAX_EVIDENCE):
        return f"evidence outside of {MIN_EVIDENCE} to {MAX_EVIDENCE}"
    if snapshot.clear.size and snapshot.clear.max() > ASSUMED:
        return f"clear that is none of 0 to {ASSUMED}"
    for part in ("cells", "driving_cells"):
        cells = getattr(snapshot, part)
        if len(np.unique(cells, axis=0)) != len(cells):
            return f"{part} that are there twice"
    return _heights_problem(snapshot.heights) or _seen_problem(snapshot.seen)


def _heights_problem(heights: NDArray | None) -> str:
    """What of the shares of height no map can hold; empty if there is nothing."""
    if heights is None or ((heights >= 0) & (heights <= MAX_HEIGHT_SHARE)).all():
        return ""
    return f"shares of height outside of 0 to {MAX_HEIGHT_SHARE:g}"


def _seen_problem(seen: SeenFrom | None) -> str:
    """What of the views no map can hold; empty if there is nothing."""
    if seen is None:
        return ""
    if not (np.abs(seen.poses) <= MAX_COORDINATE_M).all():  # also refuses NaN
        return "views from places that no map has"
    if seen.best.size and not -1 <= seen.best.min() <= seen.best.max() < len(seen.poses):
        return "cells with views that are not there"
    if not ((seen.confidence >= 0) & (seen.confidence <= MAX_CONFIDENCE)).all():
        return f"view_confidence outside of 0 to {MAX_CONFIDENCE:g}"
    return "times before 1970" if seen.last_seen_ns.min(initial=0) < 0 else ""
