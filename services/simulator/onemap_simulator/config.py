"""Configuration section ``simulator``: composed of the parameters of its parts."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from onemap_shared.params import Params
from onemap_simulator.errors import ErrorChoice
from onemap_simulator.physics.robot import RobotParams
from onemap_simulator.rendering.rgbd_camera import CameraParams

ODOMETRY_HZ = 20.0  # poses per second: fresh enough for the path tracker


class SimulatorConfig(Params):
    """A simulated robot in a simulated scene."""

    scene: str = Field(
        default="apartment",
        min_length=1,
        description="'apartment' for a generated one, or the path of a GLB, glTF, OBJ or PLY file.",
    )
    seed: int = Field(
        default=1, ge=0, description="Seed of the generated apartment and of all noise."
    )
    style: Literal["training", "held out"] = Field(
        default="training",
        description="Distributions of a generated apartment; 'held out' was never trained on.",
    )
    start: tuple[float, float, float] | None = Field(
        default=None,
        description="Where the robot starts: x and y in metres, heading in radians. Without it, "
        "as the scene says: in a generated apartment in the middle of a room.",
    )
    rgbd_hz: float = Field(
        default=8.0,
        gt=0,
        le=60,
        description="Images per second: twice the map updates a search needs.",
    )
    errors: ErrorChoice = Field(
        default="none",
        description="Of a real robot: pose that drifts, or jumps back where it was before; frames "
        "late or dropped; depth as a stereo camera's; two people who walk about; all.",
    )
    robot: RobotParams = Field(default=RobotParams(), description="Body and drive.")
    camera: CameraParams = Field(default=CameraParams(), description="RGB-D camera.")
