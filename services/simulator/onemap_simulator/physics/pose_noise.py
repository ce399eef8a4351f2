"""Errors of the pose that the simulated robot reports."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from onemap_shared.geometry import F64, pose_2d
from onemap_shared.params import Params


class PoseNoiseParams(Params):
    """Errors of the reported pose, new for each report; off by default."""

    position_m: float = Field(
        default=0.0, ge=0, le=1, description="Standard deviation of x and y; 0 is exact."
    )
    yaw_deg: float = Field(
        default=0.0,
        ge=0,
        le=45,
        description="Standard deviation of the heading in degrees; 0 is exact.",
    )


def noisy_pose(T_map_body: F64, params: PoseNoiseParams, rng: np.random.Generator) -> F64:
    """The pose (4, 4) with independent Gaussian errors; without noise nothing is drawn."""
    if not (params.position_m or params.yaw_deg):
        return T_map_body
    deviations = (params.position_m, params.position_m, float(np.radians(params.yaw_deg)))
    dx_m, dy_m, yaw_rad = rng.normal(0.0, deviations)
    return T_map_body @ pose_2d(float(dx_m), float(dy_m), float(yaw_rad))
