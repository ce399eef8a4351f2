"""What changed in a view of the map: the conditional form of ``SearchView``.

A planner asks for the same view several times a second, and a frame changes a few hundred cells
of it. It names the view that it holds, and gets the cells that changed since.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from onemap_shared.geometry import F32, I32, U8
from onemap_shared.grid import GridSpec
from onemap_shared.messages.checks import clean_texts, expect
from onemap_shared.messages.map import MAX_RIVALS, Layer

TILE_CELLS = 64  # cells along the edge of a tile: of 6.4 m at 0.1 m, a camera sees two to four
MASK_BYTES = TILE_CELLS * TILE_CELLS // 8
RANKS = 255  # of cosines, 1 to 255
MAX_KEY_CHARS = 400  # of each part of a key; that of 31 names has 250


@dataclass(frozen=True, slots=True)
class ViewKey:
    """Which state of which view a caller holds; all empty for none.

    Attributes:
        map_id: of the map in a running mapper; another one after clear, load and restart.
        query: of the names that are compared, as the mapper has embedded them.
        number: of changes to the map so far.
    """

    map_id: str = ""
    query: str = ""
    number: int = 0

    def __post_init__(self) -> None:
        for name in ("map_id", "query"):
            length = len(getattr(self, name))
            if length > MAX_KEY_CHARS:
                raise ValueError(f"{name} has {length} characters; the limit is {MAX_KEY_CHARS}")
        if self.number < 0:
            raise ValueError(f"number is {self.number}; it must not be negative")


NO_VIEW = ViewKey()


@dataclass(frozen=True, slots=True)
class ViewChangesRequest:
    """The changes of the view that ``SearchViewRequest`` asks for, since a state of it.

    Attributes:
        text: name of the object, may be empty.
        rivals: other names that what looks like ``text`` may be.
        have: the key of the newest reply that was taken in; empty: send everything.
    """

    text: str = ""
    rivals: tuple[str, ...] = ()
    have: ViewKey = NO_VIEW

    def __post_init__(self) -> None:
        if self.text:
            clean_texts(self, "text")
        if len(self.rivals) > MAX_RIVALS:
            raise ValueError(f"{len(self.rivals)} rivals; at most {MAX_RIVALS} are compared")
        clean_texts(self, "rivals", "rival")


@dataclass(frozen=True, slots=True)
class ViewChanges:
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
        values: (p, m) of those of the n cells that are observed: score in [0, 1], cosine, and
            with rivals the score of the best of them; p is 0 without a text, and in a map
            without features.
        rank_limits: (254,) ascending: the rank of a cosine among all observed cells is 1 and
            the number of limits below it; (0,) without values.
        calibrated: whether scores are probabilities; else only their order means anything.
    """

    text: str
    base: ViewKey
    key: ViewKey
    revision: int
    sequence: int
    stamp_ns: int
    grid: GridSpec
    tiles: I32
    cells: U8
    occupancy: U8
    layers: U8
    values: F32
    rank_limits: F32 = field(default_factory=lambda: np.zeros(0, np.float32))
    calibrated: bool = True

    def __post_init__(self) -> None:
        expect(self.tiles, "tiles", np.int32, (None, 2))
        expect(self.cells, "cells", np.uint8, (len(self.tiles), MASK_BYTES))
        changed = int(np.unpackbits(self.cells).sum())
        expect(self.occupancy, "occupancy", np.uint8, (changed,))
        expect(self.layers, "layers", np.uint8, (changed,))
        observed = int(np.count_nonzero(self.layers & Layer.OBSERVED))
        expect(self.values, "values", np.float32, (None, None))
        if len(self.values) not in (0, 2, 3):
            raise ValueError(f"values has {len(self.values)} rows; expected 0, 2 or 3")
        if len(self.values):
            expect(self.values, "values", np.float32, (len(self.values), observed))
        limits = RANKS - 1 if len(self.values) else 0
        expect(self.rank_limits, "rank_limits", np.float32, (limits,))
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
