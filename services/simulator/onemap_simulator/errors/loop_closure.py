"""Loop closures: at a place seen before, SLAM without a pose graph sets the pose right at once."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from onemap_shared.geometry import F64, wrap_angle, yaw_of
from onemap_shared.params import Params

PLACE_EVERY_M = 0.25  # of way between two places that are remembered
SAME_VIEW_RAD = np.pi / 4  # two views overlap by half at a field of view of 79 degrees


class LoopClosureParams(Params):
    """When the drifting pose jumps back to the true one; off by default."""

    radius_m: float = Field(
        default=0.0,
        ge=0,
        le=10,
        description="Distance in metres to an earlier place, with a heading within 45 degrees, at "
        "which it is recognised; 0 switches loop closures off.",
    )
    min_way_m: float = Field(
        default=8.0,
        gt=0,
        le=1000,
        description="Way in metres since that place and since the last closure: a loop, not a "
        "turn within one room.",
    )


class LoopClosures:
    """Recognises earlier places along the true way."""

    def __init__(self, params: LoopClosureParams) -> None:
        self._params = params
        self._way_m = 0.0
        self._closed_m = 0.0
        self._last_xy: F64 | None = None
        self._places: list[tuple[float, float, float, float]] = []  # way, x, y, yaw
        self.count = 0

    def closes(self, T_true: F64) -> bool:
        """Whether a loop closes at the next true T_map_body (4, 4)."""
        xy, yaw_rad = T_true[:2, 3], yaw_of(T_true)
        if self._last_xy is not None:
            self._way_m += float(np.linalg.norm(xy - self._last_xy))
        self._last_xy = xy
        closed = self._way_m - self._closed_m >= self._params.min_way_m and self._knows(xy, yaw_rad)
        if closed:
            self._closed_m = self._way_m
            self.count += 1
        if not self._places or self._way_m - self._places[-1][0] >= PLACE_EVERY_M:
            self._places.append((self._way_m, float(xy[0]), float(xy[1]), yaw_rad))
        return closed

    def _knows(self, xy: F64, yaw_rad: float) -> bool:
        params = self._params
        return any(
            self._way_m - way_m >= params.min_way_m
            and np.hypot(x - xy[0], y - xy[1]) <= params.radius_m
            and abs(wrap_angle(yaw - yaw_rad)) <= SAME_VIEW_RAD
            for way_m, x, y, yaw in self._places
        )
