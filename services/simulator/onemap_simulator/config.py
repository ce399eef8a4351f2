"""Configuration section ``simulator``."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from onemap_shared.params import Params
from onemap_simulator.physics.robot import RobotParams
from onemap_simulator.rendering.rgbd_camera import CameraParams

Metres = Annotated[float, Field(gt=0, le=10)]


class RobotConfig(Params):
    """The robot's body and drive; the defaults are those of a small indoor base."""

    radius_m: Metres = Field(default=0.2, description="Of its round footprint: passes any door.")
    height_m: Metres = Field(default=1.1, description="A little above the camera.")
    max_linear_mps: float = Field(default=0.7, gt=0, le=5, description="A slow walk.")
    max_angular_radps: float = Field(default=1.6, gt=0, le=10, description="A turn in 4 s.")
    linear_acceleration_mps2: float = Field(
        default=1.0, gt=0, le=20, description="Stops from full speed within 0.25 m."
    )
    angular_acceleration_radps2: float = Field(
        default=3.0, gt=0, le=60, description="Full turning speed after half a second."
    )
    deadman_s: float = Field(
        default=0.3, gt=0, le=5, description="Without a command for so long, it brakes."
    )

    def parameters(self) -> RobotParams:
        """As the physics reads them."""
        return RobotParams(**self.model_dump(exclude={"deadman_s"}))


class CameraConfig(Params):
    """The RGB-D camera; the defaults resemble common robot cameras at a person's waist."""

    width: int = Field(default=320, ge=16, le=1920, description="Pixels.")
    height: int = Field(default=240, ge=16, le=1080, description="Pixels.")
    horizontal_fov_deg: float = Field(
        default=79.0, ge=20, le=150, description="Field of view in degrees, as in Habitat."
    )
    height_m: Metres = Field(default=1.0, description="Above the floor: sees onto tables.")
    forward_m: float = Field(
        default=0.1, ge=-1, le=1, description="Ahead of the turning axis, inside the radius."
    )
    pitch_down_deg: float = Field(
        default=12.0, ge=-60, le=80, description="Degrees; shows the floor from 1.1 m on."
    )
    min_depth_m: float = Field(default=0.1, ge=0, le=5, description="Nearer reads as no return.")
    max_depth_m: Metres = Field(default=8.0, description="Farther reads as no return.")
    depth_noise_m: float = Field(
        default=0.0,
        ge=0,
        le=0.1,
        description="Standard deviation at 1 m, growing with the square of distance; 0 is ideal.",
    )

    def parameters(self) -> CameraParams:
        """As the camera reads them."""
        plain = self.model_dump(exclude={"horizontal_fov_deg", "pitch_down_deg"})
        return CameraParams(
            horizontal_fov_rad=float(np.radians(self.horizontal_fov_deg)),
            pitch_down_rad=float(np.radians(self.pitch_down_deg)),
            **plain,
        )


class PoseNoiseConfig(Params):
    """Errors of the reported pose, new for each report; off by default."""

    position_m: float = Field(default=0.0, ge=0, le=1, description="Standard deviation of x and y.")
    yaw_deg: float = Field(default=0.0, ge=0, le=45, description="Standard deviation of heading.")


class SimulatorConfig(Params):
    """A simulated robot in a simulated world."""

    scene: str = Field(
        default="apartment",
        min_length=1,
        description="'apartment' for a generated one, or the path of a GLB, glTF, OBJ or PLY file.",
    )
    seed: int = Field(default=1, ge=0, description="Of the generated apartment and of all noise.")
    style: Literal["training", "held out"] = Field(
        default="training",
        description="What a generated apartment is drawn from; 'held out' was never trained on.",
    )
    rgbd_hz: float = Field(
        default=8.0, gt=0, le=60, description="Twice the map updates a search needs."
    )
    odometry_hz: float = Field(
        default=20.0, gt=0, le=200, description="Fresh enough for the path tracker."
    )
    robot: RobotConfig = Field(default=RobotConfig(), description="Body and drive.")
    camera: CameraConfig = Field(default=CameraConfig(), description="RGB-D camera.")
    pose_noise: PoseNoiseConfig = Field(default=PoseNoiseConfig(), description="Localisation.")
