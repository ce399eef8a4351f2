"""Messages of the mapper: revisions, layers and their changes, map files.

A planner asks for the same view several times a second, and a frame changes a few hundred cells of
it. It names the view that it holds, and gets the cells that changed since.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated, TypeAlias

import numpy as np

from onemap_shared.geometry import F32, I32, MAX_COORDINATE_M, U8
from onemap_shared.grid import GridSpec
from onemap_shared.messages import checks
from onemap_shared.messages.details import Colour, Negatives

MAX_LISTED_MAPS = 200  # in one message of 256 kB
MAX_RIVALS = 30  # names that compete in one view: the mapper keeps the scores of 32 texts

MAX_FILE_TEXT_CHARS = 255  # of each text about a file, as file systems limit names
FileText: TypeAlias = Annotated[str, checks.chars(MAX_FILE_TEXT_CHARS)]
Sought: TypeAlias = Annotated[str, checks.cleaned(optional=True)]
Coordinate: TypeAlias = Annotated[float, checks.within(-MAX_COORDINATE_M, MAX_COORDINATE_M)]
Slope: TypeAlias = Annotated[float, checks.within(-90, 90)]
Rivals: TypeAlias = Annotated[tuple[str, ...], checks.items(MAX_RIVALS), checks.cleaned("rival")]


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
    DROP = 32  # occupied, because there is no floor: a step down, a stairwell


@dataclass(frozen=True, slots=True)
class CameraView(checks.Message):
    """Which heights a camera has in its image, from near and from far.

    Attributes:
        height_m: of the camera above the floor, which is z = 0 of the map frame, metres.
        down_deg: its steepest line of sight below the horizontal, degrees; negative if all of the
            image lies above it.
        up_deg: its steepest line of sight above the horizontal, degrees; negative if all of the
            image lies below it.
        across_deg: its field of view from left to right, degrees; 0: not told.
    """

    height_m: Coordinate
    down_deg: Slope
    up_deg: Slope
    across_deg: Annotated[float, checks.within(0, 180)] = 0.0


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
        camera: of this robot's newest fused frame; empty: not known.
        places_version: changes whenever a person changed a place; -1: they cannot be read.
        offset_m: how far beside where the map has it what the newest frame shows stands, metres:
            the robot was moved, or its pose is wrong; 0 if it fits.
        map_id: another one after clear, load and restart; empty: the mapper does not say.
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
    camera: tuple[CameraView, ...] = ()
    places_version: int = 0
    offset_m: float = 0.0
    map_id: str = ""


@dataclass(frozen=True, slots=True)
class SearchViewRequest(checks.Message):
    """The layers of the map for one object; with an empty text without similarity.

    Attributes:
        text: name of the object, may be empty.
        rivals: other names that what looks like ``text`` may be.
        negatives: what it must not be: they compete with it, so that ``similarity`` is lower.
        colour: of the object, a name of ``colours.RANGES``; empty: any.
    """

    text: Sought = ""
    rivals: Rivals = ()
    negatives: Negatives = ()
    colour: Colour = ""


@dataclass(frozen=True, slots=True)
class SearchView(checks.Message):
    """The layers of the map that a planner uses, all of one revision.

    Attributes:
        text: the text of the request.
        stamp_ns: capture time of this robot's newest fused frame, 0 before the first.
        occupancy: (nx, ny) values of ``Occupancy``.
        layers: (nx, ny) bits of ``Layer``.
        similarity: (nx, ny) score in [0, 1], NaN where not observed; (0, 0) without a text.
        rival: (nx, ny) the same for the best of the request's rivals; (0, 0) without any that
            the encoder knows.
        guidance: (nx, ny) rank of the cell's cosine, or of a score that is no probability, among
            all observed cells, 1 lowest to 255 highest, 0 where not observed; (0, 0) without a
            text.
        calibrated: whether the similarity is a probability; else only its order means anything.
        tops_dm: (nx, ny) how high what stands in occupied cells reaches, in decimetres, 22 also
            for what is higher; 0 elsewhere, and where it is not known; (0, 0) from older mappers.
        map_id: as in ``MapRevision``; empty in a reply to ``SearchViewRequest``.
        likeness: (nx, ny) how well each cell's colour is the request's, in [0, 1], NaN where it is
            not known; (0, 0) without one, and from older mappers.
    """

    text: str
    revision: int
    sequence: int
    stamp_ns: int
    grid: GridSpec
    occupancy: U8
    layers: U8
    similarity: Annotated[F32, checks.Shape(None, None)]
    rival: Annotated[F32, checks.Shape(None, None)] = checks.without(np.float32, 0, 0)
    guidance: Annotated[U8, checks.Shape(None, None)] = checks.without(np.uint8, 0, 0)
    calibrated: bool = True
    tops_dm: Annotated[U8, checks.Shape(None, None)] = checks.without(np.uint8, 0, 0)
    map_id: str = ""
    likeness: Annotated[F32, checks.Shape(None, None)] = checks.without(np.float32, 0, 0)

    def _check(self) -> None:
        checks.expect(self.occupancy, "occupancy", np.uint8, self.grid.shape)
        checks.expect(self.layers, "layers", np.uint8, self.grid.shape)


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
class MapMerge(checks.Message):
    """Fuse this saved map into the map in use.

    The saved map is turned about its origin, then moved, into the frame of the map in use.

    Attributes:
        name: letters, digits, dot, dash and underscore.
        x_m: metres that it is moved along x.
        y_m: metres that it is moved along y.
        yaw_rad: radians that it is turned, counter-clockwise.
    """

    name: str
    x_m: Coordinate = 0.0
    y_m: Coordinate = 0.0
    yaw_rad: Coordinate = 0.0


@dataclass(frozen=True, slots=True)
class MapListRequest:
    """Request for the saved maps.

    Attributes:
        name: only this one; empty: all.
    """

    name: str = ""


@dataclass(frozen=True, slots=True)
class SavedMap(checks.Message):
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

    name: FileText
    file_bytes: checks.Count
    saved_ns: int
    encoder_id: FileText = ""
    text_space: FileText = ""
    cell_size_m: float = 0.0
    cells_observed: checks.Count = 0
    frames_fused: checks.Count = 0
    problem: FileText = ""

    def _check(self) -> None:
        if not self.name:
            raise ValueError("a saved map has no name")


@dataclass(frozen=True, slots=True)
class MapList(checks.Message):
    """The saved maps, newest first.

    Attributes:
        maps: one entry for each file, at most 200.
        left_out: number of older files that are not listed.
    """

    maps: Annotated[tuple[SavedMap, ...], checks.items(MAX_LISTED_MAPS)]
    left_out: checks.Count = 0


@dataclass(frozen=True, slots=True)
class MapClear:
    """Empty the map."""


@dataclass(frozen=True, slots=True)
class MapSummary:
    """The answer to save, load, merge and clear: content of the map, path and size of the file.

    Attributes:
        path: of the file; empty if none was written or read.
        cell_size_m: edge of a cell, in metres.
        cells_observed: cells with a feature.
        frames_fused: frames in the map.
        file_bytes: size of the file, 0 if there is none.
        created: whether it was saved under a name that no file had.
        places_stayed: names of places that stay, though the merged map had others of these names.
    """

    path: str
    encoder_id: str
    text_space: str
    cell_size_m: float
    cells_observed: int
    frames_fused: int
    file_bytes: int = 0
    created: bool = False
    places_stayed: tuple[str, ...] = ()


TILE_CELLS = 64  # cells along the edge of a tile: of 6.4 m at 0.1 m, a camera sees two to four
MASK_BYTES = TILE_CELLS * TILE_CELLS // 8
RANKS = 255  # of cosines, 1 to 255
KeyPart: TypeAlias = Annotated[str, checks.chars(400)]  # that of 31 names has 250


@dataclass(frozen=True, slots=True)
class ViewKey(checks.Message):
    """Which state of which view a caller holds; all empty for none.

    Attributes:
        map_id: of the map in a running mapper; another one after clear, load and restart.
        query: of the names that are compared, as the mapper has embedded them.
        number: of changes to the map so far.
    """

    map_id: KeyPart = ""
    query: KeyPart = ""
    number: checks.Count = 0


NO_VIEW = ViewKey()


@dataclass(frozen=True, slots=True)
class ViewChangesRequest(checks.Message):
    """The changes of the view that ``SearchViewRequest`` asks for, since a state of it.

    Attributes:
        text: name of the object, may be empty.
        rivals: other names that what looks like ``text`` may be.
        have: the key of the newest reply that was taken in; empty: send everything.
        negatives: what it must not be.
        colour: of the object; empty: any.
    """

    text: Sought = ""
    rivals: Rivals = ()
    have: ViewKey = NO_VIEW
    negatives: Negatives = ()
    colour: Colour = ""


@dataclass(frozen=True, slots=True)
class ViewChanges(checks.Message):
    """The cells of a view that changed since ``base``; those of a tile follow each other.

    Cells that are in no reply since the one from nothing are unknown.

    Attributes:
        text: the text of the request.
        base: the state that these changes lead on from; empty: from a view without cells.
        key: the state that they lead to.
        stamp_ns: capture time of the newest fused frame, 0 for an empty map.
        grid: of the whole view, made of whole tiles.
        tiles: (k, 2) tiles with changes: world cell // 64 along x and y.
        cells: (k, 512) a bit for each of the 64 x 64 cells of a tile, along x then y, highest
            bit first: whether it changed.
        occupancy: (n,) values of ``Occupancy`` of the changed cells, in the order of the bits.
        layers: (n,) bits of ``Layer``.
        values: (p, m) of those of the n cells that are observed: score in [0, 1], cosine, or
            again a score that is no probability, with rivals the score of the best of them, and
            with a colour its likeness, NaN where the cell's is not known; p is 0 without a text,
            and in a map without features.
        rank_limits: (254,) ascending: the rank of the second value among all observed cells is 1
            and the number of limits below it; (0,) without values.
        calibrated: whether scores are probabilities; else only their order means anything.
        coloured: whether the last of the values is a likeness.
    """

    text: str
    base: ViewKey
    key: ViewKey
    revision: int
    sequence: int
    stamp_ns: int
    grid: GridSpec
    tiles: Annotated[I32, checks.Shape("K", 2)]
    cells: Annotated[U8, checks.Shape("K", MASK_BYTES)]
    occupancy: U8
    layers: U8
    values: Annotated[F32, checks.Shape(None, None)]
    rank_limits: F32 = checks.without(np.float32, 0)
    calibrated: bool = True
    coloured: bool = False

    def _check(self) -> None:
        changed = int(np.unpackbits(self.cells).sum())
        checks.expect(self.occupancy, "occupancy", np.uint8, (changed,))
        checks.expect(self.layers, "layers", np.uint8, (changed,))
        observed = int(np.count_nonzero(self.layers & Layer.OBSERVED))
        rows = len(self.values) - self.coloured
        if rows not in (0, 2, 3):
            raise ValueError(f"values has {rows} rows beside a likeness; expected 0, 2 or 3")
        if len(self.values):
            checks.expect(self.values, "values", np.float32, (len(self.values), observed))
        limits = RANKS - 1 if len(self.values) else 0
        checks.expect(self.rank_limits, "rank_limits", np.float32, (limits,))
        self._check_tiles()

    def _check_tiles(self) -> None:
        """Raise unless the grid is of whole tiles and holds each of these tiles, once."""
        edges = (*self.grid.origin_cell, *self.grid.shape)
        if any(edge % TILE_CELLS for edge in edges):
            raise ValueError(f"grid {edges} is not of whole tiles of {TILE_CELLS} cells")
        for axis in (0, 1):
            first = self.grid.origin_cell[axis] // TILE_CELLS
            last = first + self.grid.shape[axis] // TILE_CELLS - 1
            along = self.tiles[:, axis].tolist()
            if along and not first <= min(along) <= max(along) <= last:
                raise ValueError(f"tiles outside of the grid's, {first} to {last} on axis {axis}")
        if len(set(map(tuple, self.tiles.tolist()))) != len(self.tiles):
            raise ValueError("tiles that are there twice")


def ranked(values: F32, limits: F32) -> U8:
    """Rank (...) of each value (...): 1 and the number of ascending limits (at most 254) below."""
    below = np.searchsorted(limits, values, side="left")
    ranks: U8 = (below + 1).astype(np.uint8)
    return ranks
