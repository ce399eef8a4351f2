"""The robot's RGB-D camera, and the errors of real sensors where they are asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, U8, U16, camera_mount, pose_2d
from onemap_simulator.rendering.renderer import Renderer


@dataclass(frozen=True, slots=True)
class CameraParams:
    """Image size, field of view, place on the body, and what depth it measures.

    depth_noise_m: standard deviation of depth at 1 m; it grows with the square of the
    distance, as a stereo camera's does. 0 is an ideal camera.
    """

    width: int = 320
    height: int = 240
    horizontal_fov_rad: float = float(np.radians(79.0))
    height_m: float = 1.0
    forward_m: float = 0.1
    pitch_down_rad: float = float(np.radians(12.0))
    min_depth_m: float = 0.1
    max_depth_m: float = 8.0
    depth_noise_m: float = 0.0


@dataclass(frozen=True, slots=True)
class RgbdImage:
    """rgb (H, W, 3) uint8 and depth_mm (H, W) uint16, 0 = no return."""

    rgb: U8
    depth_mm: U16


class RgbdCamera:
    """Takes pictures of one scene; repeatable for the same generator and order of poses."""

    def __init__(
        self, renderer: Renderer, parameters: CameraParams, rng: np.random.Generator
    ) -> None:
        self._renderer = renderer
        self._parameters = parameters
        self._rng = rng
        self.intrinsics = Intrinsics.from_fov(
            parameters.width, parameters.height, parameters.horizontal_fov_rad
        )
        self.T_body_camera: F64 = camera_mount(
            parameters.forward_m, parameters.height_m, parameters.pitch_down_rad
        )

    def capture(self, T_map_body: F64) -> RgbdImage:
        """What the camera sees while the body is at this pose (4, 4)."""
        p = self._parameters
        view = self._renderer.render(
            T_map_body @ self.T_body_camera, self.intrinsics, width=p.width, height=p.height
        )
        depth = view.depth_m
        if p.depth_noise_m > 0:
            depth = noisy_depth(depth, p.depth_noise_m, self._rng)
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


def noisy_pose(T_map_body: F64, position_m: float, yaw_rad: float, rng: np.random.Generator) -> F64:
    """The pose (4, 4) with independent Gaussian errors of these standard deviations."""
    dx, dy, turn = rng.normal(0.0, (position_m, position_m, yaw_rad))
    return T_map_body @ pose_2d(float(dx), float(dy), float(turn))
