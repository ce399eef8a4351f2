"""A detached copy of a map, as it is saved; the map restored from one or merged with it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import AfterValidator, ConfigDict, Field

from onemap_mapper.belief.cells import SEARCHED, FeatureShare
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.tiles import MapTooLarge
from onemap_mapper.belief.version import FrameHistory
from onemap_mapper.belief.view_log import SeenFrom
from onemap_mapper.occupancy.evidence import OccupancyUpdate
from onemap_mapper.params import OBSTACLE_MIN_HEIGHT_M, MapParams
from onemap_mapper.storage.objects import NO_OBJECTS, ObjectMemory
from onemap_mapper.storage.planar_motion import NO_MOTION, PlanarMotion, moved_cells
from onemap_mapper.transfers import to_host
from onemap_shared.colours import packed, unpacked
from onemap_shared.geometry import I64
from onemap_shared.messages import MAX_FILE_TEXT_CHARS, Place

FORMAT, VERSION = "onemap-map", 2
ASSUMED = 2  # of ``clear``: free floor that no camera saw; 1: it was seen


MAX_DIMENSION = 16_384  # channels of a feature; encoders have up to 1536


def _printable(text: str) -> str:
    if not text.isprintable():  # no lone surrogates either
        raise ValueError("holds what cannot be printed")
    return text


# As messages can hold them.
Text = Annotated[str, Field(max_length=MAX_FILE_TEXT_CHARS), AfterValidator(_printable)]
Count = Annotated[int, Field(ge=0, lt=2**63)]
Metres = Annotated[float, Field(ge=0, lt=1e6, allow_inf_nan=False)]


class MapFileError(ValueError):
    """A map file that cannot be used; the text says why in one sentence."""


class EncoderMismatch(MapFileError):
    """The map was made with another encoder than the one in use."""


@dataclass(frozen=True, slots=True)
class MapHeader:
    """The header of a map file, described in docs/formats.md."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")

    format: Text
    version: Count
    encoder_id: Text
    text_space: Text
    dimension: Annotated[int, Field(ge=0, le=MAX_DIMENSION)]
    cell_size_m: Metres
    obstacle_min_height_m: Metres
    obstacle_max_height_m: Metres
    frames_fused: Count
    sequence: Count
    stamp_ns: Count

    @property
    def grid(self) -> tuple[float, float, float]:
        """As ``MapParams.grid``."""
        return self.cell_size_m, self.obstacle_min_height_m, self.obstacle_max_height_m


@dataclass(frozen=True, slots=True)
class MapSnapshot:
    """A copy of a map, detached from it.

    cells (n, 2) int32 world cells with features (n, D), confidence and searched (n,) float32;
    driving_cells (m, 2) int32 with evidence (m, levels + 1) int8 and clear (m,) uint8,
    0, 1 or ``ASSUMED``.
    explored (n,) float32: confidence of keyframes; heights (n, LEVELS) float32: shares of height;
    seen: from where the cells were seen best, and when last; colours (n, 3) uint8, as of
    ``colours.packed``, None in files of 0.1.0. objects: what was found; places: what people named.
    """

    header: MapHeader
    cells: NDArray[np.int32]
    features: NDArray
    confidence: NDArray[np.float32]
    searched: NDArray[np.float32]
    driving_cells: NDArray[np.int32]
    evidence: NDArray[np.int8]
    clear: NDArray[np.uint8]
    explored: NDArray[np.float32]
    heights: NDArray[np.float32]
    seen: SeenFrom
    colours: NDArray[np.uint8] | None = None
    objects: ObjectMemory = NO_OBJECTS
    places: tuple[Place, ...] = ()

    @property
    def nbytes(self) -> int:
        """Bytes of the arrays with all features, nearly the size of the file."""
        features = len(self.cells) * self.header.dimension * self.features.itemsize
        cells = (self.cells, self.confidence, self.searched, self.explored, self.heights)
        driving = (self.driving_cells, self.evidence, self.clear)
        arrays = (each for each in (*cells, self.colours, self.seen, *driving) if each is not None)
        return features + sum(array.nbytes for array in arrays)

    def known_colours(self) -> NDArray[np.float32]:
        """Colours (n, 3), Lab, NaN where they are not known."""
        if self.colours is not None:
            return unpacked(self.colours)
        return np.full((len(self.cells), 3), np.nan, np.float32)


def take(
    belief: BeliefMap, objects: ObjectMemory = NO_OBJECTS, places: tuple[Place, ...] = ()
) -> MapSnapshot:
    """A copy of the map's content, with the objects that were found and the named places."""
    features = _features(belief, slice(0, belief.store.count))
    return replace(outline(belief), features=features, objects=objects, places=places)


def _features(belief: BeliefMap, part: slice) -> NDArray:
    """A copy of the features (k, D) of consecutive slots, in the precision of the map."""
    features: NDArray = to_host(belief.store.features(np.arange(part.start, part.stop)))
    return features.astype(feature_dtype(belief), copy=False)


def feature_dtype(belief: BeliefMap) -> type[np.float16] | type[np.float32]:
    """Of features as they are saved."""
    return np.float16 if belief.params.torch_dtype == torch.float16 else np.float32


def outline(belief: BeliefMap) -> MapSnapshot:
    """A copy of the map's content without its features (0, D), which are nearly all of it."""
    store, params = belief.store, belief.params
    rows = belief.occupancy.known_rows
    clear, assumed = belief.occupancy.clear.values[rows], belief.occupancy.assumed.values[rows]
    header = MapHeader(
        format=FORMAT,
        version=VERSION,
        encoder_id=belief.encoder_id,
        text_space=belief.text_space,
        dimension=belief.dimension,
        cell_size_m=params.cell_size_m,
        obstacle_min_height_m=OBSTACLE_MIN_HEIGHT_M,
        obstacle_max_height_m=params.obstacle_max_height_m,
        frames_fused=belief.frames_fused,
        sequence=belief.history().sequence,
        stamp_ns=belief.history().stamp_ns,
    )
    return MapSnapshot(
        header=header,
        cells=store.cells.astype(np.int32),
        features=np.zeros((0, belief.dimension), feature_dtype(belief)),
        confidence=store.confidence,
        searched=store.searched_confidence,
        driving_cells=belief.tiles.cells(rows).astype(np.int32),
        evidence=belief.occupancy.evidence.values[rows],
        clear=clear * np.uint8(1) + assumed,
        explored=store.explored_confidence,
        heights=store.heights.copy(),
        colours=packed(store.colours),
        seen=belief.view_log.taken(belief.tiles.rows(store.cells)),
    )


def restore(
    snapshot: MapSnapshot, params: MapParams, *, encoder_id: str, first_revision: int
) -> BeliefMap:
    """A new map with the snapshot's content; its found objects are kept elsewhere.

    ``encoder_id`` is the encoder in use, empty if none is known yet. Raises ``EncoderMismatch``
    if the map was made by another one, ``MapFileError`` if it has another grid.
    """
    header = snapshot.header
    _check_header(header, params, encoder_id)
    belief = BeliefMap(params, first_revision=first_revision - 1)
    _check_levels(snapshot, params)
    _put_in(belief, snapshot, NO_MOTION)
    belief.revision = first_revision
    if header.dimension > 0:
        belief.store.set_confidence(SEARCHED, snapshot.searched)
    belief.histories[0] = FrameHistory(header.sequence, header.stamp_ns)
    return belief


def merge_into(belief: BeliefMap, taken: MapSnapshot, moved: PlanarMotion) -> None:
    """Fuse a snapshot, moved by ``moved`` into the frame of the map, into that map.

    Features are weighted by the inverse of their variance and evidence is added, so that it does
    not matter which map came first, up to rounding and the bounds of the evidence. A moved cell
    takes the content of the one in which its centre lay. Raises ``EncoderMismatch``,
    or ``MapFileError`` for another grid or a map that becomes too large, before any change.
    """
    _check(belief, taken)
    _put_in(belief, taken, moved)


def _put_in(belief: BeliefMap, taken: MapSnapshot, moved: PlanarMotion) -> None:
    header = taken.header
    cells, source = moved_cells(taken.cells.astype(np.int64), moved, header.cell_size_m)
    share = _share(taken, cells, source, moved)
    occupancy = _occupancy(taken, moved)
    try:
        every = np.concatenate([share.cells, occupancy.cells])
        driving = belief.grow(every)[len(share.cells) :]
    except MapTooLarge as problem:
        raise MapFileError(f"the map is larger than max_extent_m allows: {problem}") from problem
    if header.dimension > 0:
        if belief.dimension == 0:
            belief.set_encoder(header.encoder_id, header.text_space, header.dimension)
        belief.put_in(share)
        belief.view_log.put_in(belief.tiles.rows(cells), _seen(taken.seen.of(source), moved))
    belief.fuse_occupancy(occupancy, driving)
    belief.assume_free(driving[occupancy.blind])
    belief.frames_fused += header.frames_fused
    before = belief.history().stamp_ns
    if before < header.stamp_ns and belief.frames_fused == header.frames_fused:  # it was empty
        belief.histories[0] = FrameHistory(header.sequence, header.stamp_ns)


def _check(belief: BeliefMap, taken: MapSnapshot) -> None:
    header, params = taken.header, belief.params
    ours = (belief.encoder_id, belief.text_space, belief.dimension)
    theirs = (header.encoder_id, header.text_space, header.dimension)
    if belief.dimension and header.dimension and ours != theirs:
        raise EncoderMismatch(
            f"the map holds features of encoder {ours[0]} ({ours[1]}, {ours[2]} channels), the "
            f"saved one those of {theirs[0]} ({theirs[1]}, {theirs[2]} channels): only maps of "
            "one encoder can be merged"
        )
    if params.grid != header.grid:
        raise MapFileError(
            "the saved map has another cell size or other obstacle heights: load and save it with "
            "the present configuration first"
        )
    _check_levels(taken, params)


def _share(taken: MapSnapshot, cells: I64, source: I64, moved: PlanarMotion) -> FeatureShare:
    """The features of world cells (n, 2), each from the cell of this index (n,)."""
    confidence, explored = (
        values[source].astype(np.float64) for values in (taken.confidence, taken.explored)
    )
    features = np.asarray(taken.features)
    if moved != NO_MOTION:  # else as they lie there: a copy takes the memory of a map
        features = features[source]
    heights, colours = taken.heights[source], taken.known_colours()[source]
    return FeatureShare(cells, torch.from_numpy(features), confidence, explored, heights, colours)


def _seen(seen: SeenFrom, moved: PlanarMotion) -> SeenFrom:
    """The same views from the places of the camera in our frame."""
    if moved == NO_MOTION:
        return seen
    yaw_rad = (seen.poses[:, 2] + moved.yaw_rad + np.pi) % (2 * np.pi) - np.pi
    return replace(seen, poses=np.column_stack([moved.apply(seen.poses[:, :2]), yaw_rad]))


def _occupancy(taken: MapSnapshot, moved: PlanarMotion) -> OccupancyUpdate:
    driving_cells = taken.driving_cells.astype(np.int64)
    cells, source = moved_cells(driving_cells, moved, taken.header.cell_size_m)
    assumed = taken.clear[source] == ASSUMED
    clear = (taken.clear[source] > 0) & ~assumed
    evidence = taken.evidence[source]
    return OccupancyUpdate(cells, evidence, clear, assumed)


def _check_header(header: MapHeader, params: MapParams, encoder_id: str) -> None:
    if encoder_id and header.encoder_id and header.encoder_id != encoder_id:
        raise EncoderMismatch(
            f"the map was made with encoder {header.encoder_id}, but {encoder_id} is running"
        )
    if header.grid != params.grid:
        raise MapFileError(
            f"the map has cell size and obstacle heights {header.grid} m, the configuration "
            f"{params.grid} m"
        )


def _check_levels(snapshot: MapSnapshot, params: MapParams) -> None:
    """Raise ``MapFileError`` unless the columns are as high as ours."""
    levels = snapshot.evidence.shape[1]
    if levels != params.levels + 1:
        raise MapFileError(
            f"the map's columns have {levels} levels, ours {params.levels + 1}: the file is damaged"
        )


ARRAYS = (
    "cells",
    "features",
    "confidence",
    "searched",
    "explored",
    "driving_cells",
    "evidence",
    "clear",
)


def sha256_of(snapshot: MapSnapshot) -> str:
    """Of the header and of every array with its dtype and shape; found objects do not count."""
    digest = hashlib.sha256(json.dumps(asdict(snapshot.header), sort_keys=True).encode())
    for name in ARRAYS:
        array = np.ascontiguousarray(getattr(snapshot, name))
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(array.reshape(-1).view(np.uint8).data)
    return digest.hexdigest()
