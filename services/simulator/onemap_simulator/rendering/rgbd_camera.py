"""The robot's RGB-D camera, with the depth errors of a stereo camera on request."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from pydantic import Field

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, U8, U16, Bool, camera_mount
from onemap_shared.params import Params
from onemap_simulator.physics.people import NOBODY, Bystanders
from onemap_simulator.rendering.depth_errors import (
    DepthErrorParams,
    faces_without_return,
    with_depth_errors,
)
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.scene.scene import Scene


class CameraParams(Params):
    """The RGB-D camera; the defaults resemble common robot cameras at a person's waist."""

    width: int = Field(
        default=320, ge=16, le=1920, description="Image width in pixels: rendered in real time."
    )
    height: int = Field(
        default=240, ge=16, le=1080, description="Image height in pixels: 4 to 3, as most cameras."
    )
    horizontal_fov_deg: float = Field(
        default=79.0, ge=20, le=150, description="Field of view in degrees, as in Habitat."
    )
    height_m: float = Field(
        default=1.0, gt=0, le=10, description="Height above the floor: sees onto tables."
    )
    forward_m: float = Field(
        default=0.1, ge=-1, le=1, description="Ahead of the turning axis, inside the radius."
    )
    pitch_down_deg: float = Field(
        default=12.0, ge=-60, le=80, description="Tilt in degrees; shows the floor from 1.1 m on."
    )
    min_depth_m: float = Field(
        default=0.1, ge=0, le=5, description="Smallest depth measured; nearer reads as no return."
    )
    max_depth_m: float = Field(
        default=8.0, gt=0, le=10, description="Largest depth measured; farther reads as no return."
    )
    depth_noise_m: float = Field(
        default=0.0,
        ge=0,
        le=0.1,
        description="Standard deviation at 1 m, growing with the square of distance, as a stereo "
        "camera's does; 0 is ideal.",
    )
    depth_errors: DepthErrorParams = Field(
        default=DepthErrorParams(), description="Edges, glass, black surfaces, steps."
    )

    @property
    def intrinsics(self) -> Intrinsics:
        """Square pixels, the principal point in the middle of the image."""
        return Intrinsics.from_fov(
            self.width, self.height, float(np.radians(self.horizontal_fov_deg))
        )

    @property
    def mount(self) -> F64:
        """T_body_camera (4, 4)."""
        return camera_mount(self.forward_m, self.height_m, float(np.radians(self.pitch_down_deg)))


@dataclass(frozen=True, slots=True)
class RgbdImage:
    """One measurement: rgb (H, W, 3) uint8 and depth_mm (H, W) uint16, 0 = no return."""

    rgb: U8
    depth_mm: U16


class SceneRenderer(Protocol):
    """Renders one scene from any pose."""

    def render(
        self,
        T_map_camera: F64,
        intrinsics: Intrinsics,
        *,
        width: int,
        height: int,
        people: Bystanders = NOBODY,
    ) -> RenderedImage:
        """The image at T_map_camera (4, 4), with people."""


class RgbdCamera:
    """Captures RGB-D images of one scene; deterministic for a generator and order of poses.

    without_return (F + 1,): as ``faces_without_return``; None: every surface gives depth.
    """

    def __init__(
        self,
        renderer: SceneRenderer,
        params: CameraParams,
        rng: np.random.Generator,
        without_return: Bool | None = None,
    ) -> None:
        self._renderer = renderer
        self._params = params
        self._rng = rng
        self._without_return = without_return
        self.intrinsics = params.intrinsics
        self.T_body_camera = params.mount

    @classmethod
    def of(
        cls,
        scene: Scene,
        renderer: SceneRenderer,
        params: CameraParams,
        rng: np.random.Generator,
    ) -> RgbdCamera:
        """A camera that measures depth as the surfaces of the scene allow."""
        if params.depth_errors == DepthErrorParams():
            return cls(renderer, params, rng)
        return cls(renderer, params, rng, faces_without_return(scene, params.depth_errors))

    def capture(self, T_map_body: F64, people: Bystanders = NOBODY) -> RgbdImage:
        """The image from the body's pose (4, 4)."""
        p = self._params
        view = self._renderer.render(
            T_map_body @ self.T_body_camera,
            self.intrinsics,
            width=p.width,
            height=p.height,
            people=people,
        )
        depth = view.depth_m
        if p.depth_noise_m > 0:
            depth = noisy_depth(depth, p.depth_noise_m, self._rng)
        if self._without_return is not None:
            depth = with_depth_errors(
                depth, view.faces, self._without_return, p.depth_errors, self._rng
            )
        return RgbdImage(view.rgb, measured_mm(depth, p.min_depth_m, p.max_depth_m))


def noisy_depth(depth_m: F32, noise_m: float, rng: np.random.Generator) -> F32:
    """Depth (H, W) with Gaussian errors of ``noise_m`` times the square of the depth in metres."""
    error = rng.standard_normal(depth_m.shape, np.float32)
    noisy: F32 = depth_m + np.float32(noise_m) * depth_m**2 * error
    return noisy


def measured_mm(depth_m: F32, min_depth_m: float, max_depth_m: float) -> U16:
    """Depth (H, W) as uint16 millimetres; 0 where it is out of the camera's range."""
    in_range = (depth_m >= min_depth_m) & (depth_m <= max_depth_m)
    millimetres: U16 = np.where(in_range, np.rint(depth_m * 1000), 0).astype(np.uint16)
    return millimetres
