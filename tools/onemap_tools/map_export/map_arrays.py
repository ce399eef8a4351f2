"""The arrays of ``GET /v1/map.npz``."""

from __future__ import annotations

import io
from dataclasses import dataclass
from zipfile import BadZipFile

import numpy as np

from onemap_shared.geometry import F32, U8, Bool
from onemap_shared.messages import Layer, Occupancy


@dataclass(frozen=True, slots=True)
class MapArrays:
    """occupancy and layers (nx, ny) uint8, similarity (nx, ny) float32 or (0, 0) without a text.

    Indexed [ix, iy]; origin_m: x, y in metres of the lower left corner of cell [0, 0].
    """

    occupancy: U8
    layers: U8
    similarity: F32
    origin_m: tuple[float, float]
    cell_size_m: float

    def mask(self, layer: Layer) -> Bool:
        """Cells (nx, ny) with this bit."""
        found: Bool = (self.layers & layer) > 0
        return found

    @property
    def known(self) -> Bool:
        """Cells (nx, ny) of which anything is known."""
        found: Bool = (self.occupancy != Occupancy.UNKNOWN) | self.mask(Layer.OBSERVED)
        return found


def read_archive(content: bytes) -> MapArrays:
    """The arrays of an archive; raises ValueError if it is none."""
    try:
        archive = np.lib.npyio.NpzFile(io.BytesIO(content), allow_pickle=False)
        x_m, y_m = archive["origin_m"].tolist()
        arrays = MapArrays(
            archive["occupancy"],
            archive["layers"],
            archive["similarity"],
            (x_m, y_m),
            float(archive["cell_size_m"]),
        )
    except (KeyError, OSError, ValueError, TypeError, BadZipFile) as problem:
        raise ValueError(f"what the gateway sent is no map: {problem}") from problem
    if arrays.occupancy.shape != arrays.layers.shape or arrays.occupancy.ndim != 2:
        raise ValueError(f"the map's layers have shapes that differ: {arrays.layers.shape}")
    return arrays
