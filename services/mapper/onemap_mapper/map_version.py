"""A whole revision of a map without its features: what replies say beside scores."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onemap_mapper.tiles import TileIndex
from onemap_mapper.view_log import ViewLog
from onemap_shared.geometry import F32, I32, U8, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Layer, Occupancy

NO_SLOT = -1


@dataclass(frozen=True, slots=True)
class MapVersion:
    """One revision; ``BeliefMap.version`` makes it a copy that no later frame changes.

    By rows (n,) of ``tiles``: slots int32, NO_SLOT where nothing was observed; occupancy, values of
    ``Occupancy``; assumed: free, though no camera saw the floor. By slots: confidences (3, count)
    float32, as ``CellStore.confidences``; heights (count, LEVELS) float32, as ``HeightStore.of``. A
    cell is explored below ``explored_variance``.
    """

    revision: int
    sequence: int
    stamp_ns: int
    encoder_id: str
    explored_variance: float
    tiles: TileIndex
    slots: I32
    occupancy: U8
    assumed: Bool
    confidences: F32
    heights: F32
    view_log: ViewLog

    @property
    def count(self) -> int:
        """Observed cells."""
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
        threshold = np.float32(1.0 / self.explored_variance)
        _, searched, explored = self.confidences > threshold
        bits = np.full(self.count + 1, Layer.OBSERVED, np.uint8)
        bits[:-1] |= explored * np.uint8(Layer.EXPLORED) | searched * np.uint8(Layer.SEARCHED)
        bits[NO_SLOT] = 0
        dense: U8 = bits[self._dense(self.slots, NO_SLOT)]
        dense |= self._dense(self.assumed, False) * np.uint8(Layer.ASSUMED)
        return dense

    def occupancy_grid(self) -> U8:
        """Values of ``Occupancy`` (nx, ny) uint8 over ``grid``."""
        dense: U8 = self._dense(self.occupancy, Occupancy.UNKNOWN)
        return dense

    def to_grid(self, per_slot: F32) -> F32:
        """Values (count,) of the observed cells as a grid (nx, ny) float32, NaN elsewhere."""
        padded = np.append(per_slot, np.float32(np.nan))
        dense: F32 = padded[self._dense(self.slots, NO_SLOT)]
        return dense

    def _dense(self, values: NDArray, fill: float) -> NDArray:
        return self.tiles.to_dense(values, fill)
