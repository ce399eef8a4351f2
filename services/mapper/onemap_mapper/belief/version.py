"""A whole revision of a map without its features, and what is remembered of a robot's frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from onemap_mapper.belief.cells import EXPLORED, searched_row
from onemap_mapper.belief.tiles import TileIndex
from onemap_mapper.belief.view_log import Keyframes, ViewLog, Views
from onemap_mapper.frame.update import FrameUpdate
from onemap_mapper.occupancy.heights import tops_dm
from onemap_shared.colours import likeness
from onemap_shared.geometry import F32, F64, I32, U8, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Layer, Occupancy


@dataclass(frozen=True, slots=True)
class FrameHistory:
    """The frames of one robot in one map.

    sequence and stamp_ns: of the newest one, 0 before the first; frames: how many were fused since
    the map was begun or loaded; start_m and camera_m (3,): the camera's position in the first and
    in the newest one, map frame, None if it is not known; offset_m: how far beside the map that one
    stands, see ``MapRevision``.
    """

    sequence: int = 0
    stamp_ns: int = 0
    frames: int = 0
    start_m: F64 | None = None
    camera_m: F64 | None = None
    offset_m: float = 0.0
    keyframes: Keyframes = field(default_factory=Keyframes)

    def with_frame(self, update: FrameUpdate, views: Views, offset_m: float) -> FrameHistory:
        """The history after a frame that counted for so many views."""
        return FrameHistory(
            sequence=update.sequence,
            stamp_ns=update.stamp_ns,
            frames=self.frames + 1,
            start_m=update.camera_m if self.start_m is None else self.start_m,
            camera_m=update.camera_m,
            offset_m=offset_m,
            keyframes=self.keyframes.with_frame(update.T_map_camera, views),
        )

    def of_new_search(self) -> FrameHistory:
        """What is in view when a search begins was not searched yet."""
        return replace(self, keyframes=self.keyframes.of_new_search())


NO_FRAMES = FrameHistory()


NO_SLOT = -1


def observed_bits(confidences: F32, explored_variance: float, robot: int = 0) -> U8:
    """Bits of ``Layer`` (n,) of observed cells with these confidences (3 + further robots, n)."""
    threshold = np.float32(1.0 / explored_variance)
    count, row = confidences.shape[1], searched_row(robot)
    explored = confidences[EXPLORED] > threshold
    known = row < len(confidences)  # else the robot has searched nothing yet
    searched = confidences[row] > threshold if known else np.zeros(count, bool)
    bits = np.full(count, Layer.OBSERVED, np.uint8)
    bits |= explored * np.uint8(Layer.EXPLORED) | searched * np.uint8(Layer.SEARCHED)
    return bits


def floor_bits(assumed: Bool, clear: Bool, drops: Bool) -> U8:
    """Bits of ``Layer`` for what is known of the floor, of masks of the same shape.

    clear: where a camera saw it once, or it is assumed: only counts as free; drops: where it is
    missing.
    """
    seen = clear & ~assumed
    bits: U8 = assumed * np.uint8(Layer.ASSUMED) | seen * np.uint8(Layer.FLOOR_SEEN)
    bits |= drops * np.uint8(Layer.DROP)
    return bits


@dataclass(frozen=True, slots=True)
class MapVersion:
    """One revision; ``BeliefMap.version`` makes it a copy that no later frame changes.

    By rows (n,) of ``tiles``: slots int32, NO_SLOT where nothing was observed; occupancy, values of
    ``Occupancy``; assumed: free, though no camera saw the floor; clear: a camera saw the floor
    once, or it is assumed; drops: there is no floor. By slots: confidences
    (3 + further robots, count) float32, as ``CellStore.confidences``; heights (count, LEVELS) and
    colours (count, 3) float32, as there. A cell is explored below ``explored_variance``.

    It is one robot's: searched is what that one searched, sequence and stamp_ns are of its frames.
    """

    revision: int
    histories: Mapping[int, FrameHistory]
    encoder_id: str
    explored_variance: float
    tiles: TileIndex
    slots: I32
    occupancy: U8
    assumed: Bool
    clear: Bool
    drops: Bool
    confidences: F32
    heights: F32
    colours: F32
    view_log: ViewLog
    robot: int = 0

    @property
    def sequence(self) -> int:
        return self._history.sequence

    @property
    def stamp_ns(self) -> int:
        """Capture time of the robot's newest frame; 0: it has none in the map."""
        return self._history.stamp_ns

    @property
    def _history(self) -> FrameHistory:
        return self.histories.get(self.robot, NO_FRAMES)

    @property
    def nbytes(self) -> int:
        rows = (self.slots, self.occupancy, self.assumed, self.clear, self.drops)
        cells = (self.confidences, self.heights, self.colours)
        logs = self.tiles.nbytes + self.view_log.nbytes
        return sum(each.nbytes for each in (*rows, *cells)) + logs

    def of_robot(self, robot: int) -> MapVersion:
        """The same revision for another robot."""
        return replace(self, robot=robot)

    @property
    def count(self) -> int:
        return len(self.confidences[0])

    @property
    def grid(self) -> GridSpec:
        """The bounding box of all tiles."""
        return self.tiles.grid

    @property
    def variances(self) -> F32:
        """1 / c (count,) of the observed cells."""
        variances: F32 = np.reciprocal(self.confidences[0])
        return variances

    def layers(self) -> U8:
        """Bits of ``Layer`` (nx, ny) uint8 over ``grid``."""
        bits = observed_bits(self.confidences, self.explored_variance, self.robot)
        bits = np.append(bits, np.uint8(0))
        dense: U8 = bits[self._dense(self.slots, NO_SLOT)]
        floor = (self._dense(each, False) for each in (self.assumed, self.clear, self.drops))
        return dense | floor_bits(*floor)

    def occupancy_grid(self) -> U8:
        """Values of ``Occupancy`` (nx, ny) uint8 over ``grid``."""
        dense: U8 = self._dense(self.occupancy, Occupancy.UNKNOWN)
        return dense

    def obstacle_tops_dm(self) -> U8:
        """How high what stands in occupied cells reaches, (nx, ny) uint8 as of ``tops_dm``.

        0 elsewhere, and where it is not known.
        """
        rows = np.flatnonzero((self.occupancy == Occupancy.OCCUPIED) & (self.slots != NO_SLOT))
        tops: U8 = np.zeros(len(self.slots), np.uint8)
        tops[rows] = tops_dm(self.heights[self.slots[rows]])
        dense: U8 = self._dense(tops, 0)
        return dense

    def likeness(self, colour: str) -> F32 | None:
        """How well each cell's colour is the named one, (nx, ny) in [0, 1], NaN where it is not
        known; None without a name."""
        return self.to_grid(likeness(self.colours, colour)) if colour else None

    def to_grid(self, per_slot: F32) -> F32:
        """Values (count,) of the observed cells as a grid (nx, ny) float32, NaN elsewhere."""
        padded = np.append(per_slot, np.float32(np.nan))
        dense: F32 = padded[self._dense(self.slots, NO_SLOT)]
        return dense

    def _dense(self, values: NDArray, fill: float) -> NDArray:
        return self.tiles.to_dense(values, fill)
