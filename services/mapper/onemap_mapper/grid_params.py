"""Parameters of the map's grid, which all that works on cells shares."""

from __future__ import annotations

from math import ceil

from pydantic import Field, model_validator

from onemap_shared.grid import MAX_CELLS
from onemap_shared.params import Params


class GridParams(Params):
    """The grid of the map, and how loops over its cells are computed."""

    compiled: bool = Field(
        default=True,
        description="Whether loops over pixels and cells are compiled, where numba is installed "
        "and device is cpu: a frame takes a quarter of the time. The first start compiles, "
        "minutes on a busy machine, and says so in log and status; the result is kept in "
        "NUMBA_CACHE_DIR, else beside the program or in the user's cache folder. false: numpy and "
        "torch only, where a process must not generate code.",
    )

    cell_size_m: float = Field(
        default=0.1, gt=0, le=1, description="m; the paper's 10 cells per metre."
    )
    max_extent_m: float = Field(
        default=200.0,
        ge=10,
        le=2000,
        description="m; side of the largest map, and how far from the origin it may begin. A pose "
        "that jumps further is refused, instead of a grid that fills the memory; 409 m at the "
        "default cell size is the most that is allowed.",
    )

    @property
    def max_cells(self) -> int:
        """Cells of the largest map."""
        return ceil(self.max_extent_m / self.cell_size_m) ** 2

    @model_validator(mode="after")
    def _check_extent(self) -> GridParams:
        cells = self.max_extent_m / self.cell_size_m
        if cells**2 > MAX_CELLS:
            most_m = MAX_CELLS**0.5 * self.cell_size_m
            raise ValueError(
                f"max_extent_m is {self.max_extent_m:g}, but cells of {self.cell_size_m:g} m allow "
                f"{most_m:.0f} m: make the map smaller or its cells larger"
            )
        return self
