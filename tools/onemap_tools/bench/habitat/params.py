"""The robot in Habitat: body, camera and limits, as in the paper's evaluation and the challenge."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F64, camera_mount
from onemap_shared.params import Params


class HabitatRobotParams(Params):
    """Body and RGB-D camera of the agent."""

    radius_m: float = Field(
        default=0.18, gt=0, le=2, description="Agent's radius in metres, as in the challenge."
    )
    height_m: float = Field(
        default=0.88, gt=0, le=3, description="Agent's height in metres, as in the challenge."
    )
    camera_height_m: float = Field(
        default=0.88, gt=0, le=3, description="Of the level camera, metres, as the paper's."
    )
    width: int = Field(
        default=640, ge=16, le=1920, description="Image width in pixels, as the paper's."
    )
    height: int = Field(
        default=640,
        ge=16,
        le=1920,
        description="Image height in pixels: square as the paper's, the floor is seen from "
        "0.88 m on.",
    )
    horizontal_fov_deg: float = Field(
        default=90.0, ge=20, le=150, description="Field of view in degrees, as the paper's."
    )
    min_depth_m: float = Field(
        default=0.5, ge=0, le=5, description="Nearer reads as no return: the challenge's limit."
    )
    max_depth_m: float = Field(
        default=5.0, gt=0, le=60, description="Farther reads as no return: the challenge's limit."
    )
    max_linear_mps: float = Field(
        default=0.7, gt=0, le=5, description="Limit of the speed, as the simulator's robot has it."
    )
    max_angular_radps: float = Field(
        default=1.6, gt=0, le=10, description="Limit of turning, as the simulator's robot has it."
    )
    deadman_s: float = Field(
        default=0.3, gt=0, le=5, description="Stands after so many seconds without a command."
    )

    @property
    def intrinsics(self) -> Intrinsics:
        """Square pixels, the principal point in the middle of the image."""
        fov_rad = float(np.radians(self.horizontal_fov_deg))
        return Intrinsics.from_fov(self.width, self.height, fov_rad)

    @property
    def mount(self) -> F64:
        """T_body_camera (4, 4): level, above the turning axis."""
        return camera_mount(0.0, self.camera_height_m, 0.0)
