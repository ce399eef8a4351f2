"""Messages of the mapper: revisions, similarity, layers, map files."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from onemap_shared.geometry import F32, U8
from onemap_shared.grid import GridSpec
from onemap_shared.messages.checks import clean_texts, expect, expect_share

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


@dataclass(frozen=True, slots=True)
class MapRevision:
    """The state of the map after the newest fused frame.

    Attributes:
        frames_fused: frames in the map.
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
class SimilarityRequest:
    """Request for the regions of the map most similar to a text.

    Attributes:
        text: what to look for.
        max_regions: number of regions in the reply, 1 to 100.
        include_grid: whether the reply carries the score of every cell.
    """

    text: str
    max_regions: int = 5
    include_grid: bool = False

    def __post_init__(self) -> None:
        clean_texts(self, "text")
        if not 1 <= self.max_regions <= 100:
            raise ValueError(f"max_regions is {self.max_regions}; it must lie in [1, 100]")


@dataclass(frozen=True, slots=True)
class SimilarityReply:
    """Ranked regions of high similarity, best first, and the grid if it was requested.

    Attributes:
        text: the text of the request.
        centres_m: (N, 2) x, y of each region.
        extents_m: (N, 4) x_min, y_min, x_max, y_max of each region.
        scores: (N,) in [0, 1]; no region scores below ``floor``.
        variances: (N,) variance of the feature of each region.
        scores_grid: (nx, ny) score of each cell, NaN where nothing was observed; (0, 0) if not
            requested.
        best_score: of the best region before those below the floor were left out, 0 if nothing
            was observed.
        floor: the encoder's, 0 if it was not measured.
        nearest: known words near a text outside the encoder's vocabulary.
    """

    text: str
    revision: int
    stamp_ns: int
    encoder_id: str
    centres_m: F32
    extents_m: F32
    scores: F32
    variances: F32
    grid: GridSpec
    scores_grid: F32
    best_score: float = 0.0
    floor: float = 0.0
    nearest: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.scores)
        expect(self.centres_m, "centres_m", np.float32, (count, 2))
        expect(self.extents_m, "extents_m", np.float32, (count, 4))
        expect(self.scores, "scores", np.float32, (count,))
        expect(self.variances, "variances", np.float32, (count,))
        expect(self.scores_grid, "scores_grid", np.float32, (None, None))
        expect_share(self.best_score, "best_score")
        expect_share(self.floor, "floor")


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
        stamp_ns: capture time of the newest fused frame, 0 for an empty map.
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
    """Reset sigma_E, as a new search begins; features and their variance stay."""

    search_id: str


@dataclass(frozen=True, slots=True)
class MapFile:
    """Save to, load from or delete this file name (no folder) in the mapper's map folder.

    Attributes:
        name: letters, digits, dot, dash and underscore.
    """

    name: str


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
