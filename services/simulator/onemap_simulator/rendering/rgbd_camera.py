"""The robot's RGB-D camera, with the depth errors of a stereo camera on request."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from pydantic import Field

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, U8, U16, Bool, camera_mount
from onemap_shared.params import Params
from onemap_simulator.errors import DepthErrorParams
from onemap_simulator.physics.people import NOBODY, Bystanders
from onemap_simulator.rendering.depth_errors import faces_without_return, with_depth_errors
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.scene.scene import Scene

NO_ERRORS = DepthErrorParams()


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
    pitch_down_deg: float = Field(
        default=12.0, ge=-60, le=80, description="Tilt in degrees; shows the floor from 1.1 m on."
    )
    forward_m: ClassVar[float] = 0.1  # ahead of the turning axis, inside the radius
    # What is nearer or farther reads as no return.
    min_depth_m: ClassVar[float] = 0.1
    max_depth_m: ClassVar[float] = 8.0

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

    errors: of the measured depth; where there are any, without_return (F + 1,) says which faces
    give none, as ``faces_without_return`` does.
    """

    def __init__(
        self,
        renderer: SceneRenderer,
        params: CameraParams,
        rng: np.random.Generator,
        errors: DepthErrorParams = NO_ERRORS,
        without_return: Bool | None = None,
    ) -> None:
        self._renderer = renderer
        self._params = params
        self._rng = rng
        self._errors = errors
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
        errors: DepthErrorParams,
    ) -> RgbdCamera:
        """A camera that measures depth as the surfaces of the scene allow."""
        if errors == NO_ERRORS:
            return cls(renderer, params, rng)
        return cls(renderer, params, rng, errors, faces_without_return(scene, errors))

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
        if self._errors.noise_m > 0:
            depth = noisy_depth(depth, self._errors.noise_m, self._rng)
        if self._without_return is not None:
            depth = with_depth_errors(
                depth, view.faces, self._without_return, self._errors, self._rng
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
