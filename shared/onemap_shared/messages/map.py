"""Messages of the mapper: revisions, layers, map files."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from onemap_shared.geometry import F32, MAX_COORDINATE_M, U8
from onemap_shared.grid import GridSpec
from onemap_shared.messages.checks import clean_texts, expect

MAX_LISTED_MAPS = 200  # in one message of 256 kB
MAX_RIVALS = 30  # names that compete in one view: the mapper keeps the scores of 32 texts

SHA256 = re.compile(r"[0-9a-f]{64}")
MAX_FILE_TEXT_CHARS = 255  # of each text about a file, as file systems limit names


class Occupancy(IntEnum):
    """State of a map cell, for driving."""

    UNKNOWN = 0
    FREE = 1
    OCCUPIED = 2


class Layer(IntEnum):
    """Bit flags of ``SearchView.layers``."""

    OBSERVED = 1  # O: any feature was fused here
    EXPLORED = 2  # E: variance below the threshold
    SEARCHED = 4  # C: the same, since the search of this object began
    ASSUMED = 8  # counts as free, but no camera saw the floor, or not since something stood here
    FLOOR_SEEN = 16  # a camera saw the floor here, whatever stands here now


@dataclass(frozen=True, slots=True)
class MapRevision:
    """The state of the map after the newest fused frame.

    Where robots share a map, each gets it under its own keys, with every change of the map.

    Attributes:
        sequence: of this robot's newest fused frame.
        stamp_ns: capture time of that frame, 0 before the first.
        frames_fused: frames in the map, of all its robots.
        cells_observed: cells with a feature.
        memory_bytes: memory that the map takes.
        update_ms: milliseconds that the last frame took.
        rate_hz: frames fused per second, of late.
        objects_version: changes whenever the list of found objects does.
    """

    revision: int
    sequence: int
    stamp_ns: int
    encoder_id: str
    text_space: str
    frames_fused: int
    cells_observed: int
    memory_bytes: int
    update_ms: float
    rate_hz: float
    objects_version: int = 0


@dataclass(frozen=True, slots=True)
class SearchViewRequest:
    """The layers of the map for one object; with an empty text without similarity.

    Attributes:
        text: name of the object, may be empty.
        rivals: other names that what looks like ``text`` may be.
    """

    text: str = ""
    rivals: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.text:
            clean_texts(self, "text")
        if len(self.rivals) > MAX_RIVALS:
            raise ValueError(f"{len(self.rivals)} rivals; at most {MAX_RIVALS} are compared")
        clean_texts(self, "rivals", "rival")


@dataclass(frozen=True, slots=True)
class SearchView:
    """The layers of the map that a planner uses, all of one revision.

    Attributes:
        text: the text of the request.
        stamp_ns: capture time of this robot's newest fused frame, 0 before the first.
        occupancy: (nx, ny) values of ``Occupancy``.
        layers: (nx, ny) bits of ``Layer``.
        similarity: (nx, ny) score in [0, 1], NaN where not observed; (0, 0) without a text.
        rival: (nx, ny) the same for the best of the request's rivals; (0, 0) without any that
            the encoder knows.
        guidance: (nx, ny) rank of the cell's cosine among all observed cells, 1 lowest to 255
            highest, 0 where not observed; (0, 0) without a text.
        calibrated: whether the similarity is a probability; else only its order means anything.
    """

    text: str
    revision: int
    sequence: int
    stamp_ns: int
    grid: GridSpec
    occupancy: U8
    layers: U8
    similarity: F32
    rival: F32 = field(default_factory=lambda: np.zeros((0, 0), np.float32))
    guidance: U8 = field(default_factory=lambda: np.zeros((0, 0), np.uint8))
    calibrated: bool = True

    def __post_init__(self) -> None:
        expect(self.occupancy, "occupancy", np.uint8, self.grid.shape)
        expect(self.layers, "layers", np.uint8, self.grid.shape)
        expect(self.similarity, "similarity", np.float32, (None, None))
        expect(self.rival, "rival", np.float32, (None, None))
        expect(self.guidance, "guidance", np.uint8, (None, None))


@dataclass(frozen=True, slots=True)
class SearchReset:
    """Reset this robot's sigma_E, as its search begins; features and their variance stay."""

    search_id: str


@dataclass(frozen=True, slots=True)
class MapFile:
    """Save to, load from or delete this file name (no folder) in the mapper's map folder.

    Attributes:
        name: letters, digits, dot, dash and underscore.
    """

    name: str


@dataclass(frozen=True, slots=True)
class MapMerge:
    """Fuse this saved map into the map in use.

    The saved map is turned about its origin, then moved, into the frame of the map in use.

    Attributes:
        name: letters, digits, dot, dash and underscore.
        x_m: metres that it is moved along x.
        y_m: metres that it is moved along y.
        yaw_rad: radians that it is turned, counter-clockwise.
    """

    name: str
    x_m: float = 0.0
    y_m: float = 0.0
    yaw_rad: float = 0.0

    def __post_init__(self) -> None:
        for field_name in ("x_m", "y_m", "yaw_rad"):
            value = getattr(self, field_name)
            if not abs(value) <= MAX_COORDINATE_M:  # also refuses NaN
                raise ValueError(
                    f"{field_name} is {value}; it must lie within {MAX_COORDINATE_M:g}"
                )


@dataclass(frozen=True, slots=True)
class MapListRequest:
    """Request for the saved maps.

    Attributes:
        name: only this one; empty: all.
    """

    name: str = ""


@dataclass(frozen=True, slots=True)
class SavedMap:
    """A file in the mapper's map folder. What its header holds is empty or 0 if unreadable.

    Attributes:
        name: under which it is loaded.
        file_bytes: size of the file.
        saved_ns: when it was written, in nanoseconds of the mapper's wall clock.
        encoder_id: of the map in it.
        cell_size_m: edge of a cell, in metres.
        cells_observed: cells with a feature.
        frames_fused: frames in the map.
        problem: why the file cannot be read, in one sentence; else empty.
    """

    name: str
    file_bytes: int
    saved_ns: int
    encoder_id: str = ""
    text_space: str = ""
    cell_size_m: float = 0.0
    cells_observed: int = 0
    frames_fused: int = 0
    problem: str = ""

    def __post_init__(self) -> None:
        if not self.name:
            raise ValueError("a saved map has no name")
        for field_name in ("name", "encoder_id", "text_space", "problem"):
            length = len(getattr(self, field_name))
            if length > MAX_FILE_TEXT_CHARS:
                raise ValueError(
                    f"{field_name} has {length} characters; the limit is {MAX_FILE_TEXT_CHARS}"
                )
        for field_name in ("file_bytes", "cells_observed", "frames_fused"):
            value = getattr(self, field_name)
            if value < 0:
                raise ValueError(f"{field_name} is {value}; it must not be negative")


@dataclass(frozen=True, slots=True)
class MapList:
    """The saved maps, newest first.

    Attributes:
        maps: one entry for each file, at most 200.
        left_out: number of older files that are not listed.
    """

    maps: tuple[SavedMap, ...]
    left_out: int = 0

    def __post_init__(self) -> None:
        if len(self.maps) > MAX_LISTED_MAPS:
            raise ValueError(f"{len(self.maps)} maps; at most {MAX_LISTED_MAPS} are listed")
        if self.left_out < 0:
            raise ValueError(f"left_out is {self.left_out}; it must not be negative")


@dataclass(frozen=True, slots=True)
class MapClear:
    """Empty the map."""


@dataclass(frozen=True, slots=True)
class MapSummary:
    """The answer to save, load and clear: content of the map, path and size of the file.

    Attributes:
        path: of the file; empty if none was written or read.
        cell_size_m: edge of a cell, in metres.
        cells_observed: cells with a feature.
        frames_fused: frames in the map.
        file_bytes: size of the file, 0 if there is none.
        created: whether it was saved under a name that no file had.
    """

    path: str
    encoder_id: str
    text_space: str
    cell_size_m: float
    cells_observed: int
    frames_fused: int
    file_bytes: int = 0
    created: bool = False


@dataclass(frozen=True, slots=True)
class MapDigestRequest:
    """Request for the digest of the map in use, with which a recording is checked."""


@dataclass(frozen=True, slots=True)
class MapDigest:
    """What the map holds, as one number, and how it was made.

    Attributes:
        frames_fused: frames in the map.
        sha256: 64 hexadecimal digits, of cells, features, confidences and occupancy; two maps
            with the same digest are equal bit for bit.
        settings: the mapper's section of the configuration as JSON, without its folder.
        versions: of the libraries that compute the map; others may round otherwise.
    """

    revision: int
    sequence: int
    stamp_ns: int
    encoder_id: str
    frames_fused: int
    sha256: str
    settings: str
    versions: str

    def __post_init__(self) -> None:
        if not SHA256.fullmatch(self.sha256):
            raise ValueError(f"sha256 is {self.sha256[:80]!r}; it has 64 hexadecimal digits")
