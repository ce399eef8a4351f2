"""The robot's RGB-D camera, with the depth errors of a stereo camera on request."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import cv2
import numpy as np
from pydantic import Field

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, I32, U8, U16, Bool, camera_mount
from onemap_shared.params import Params
from onemap_simulator.errors import EDGE_JUMP, DepthErrorParams
from onemap_simulator.physics.people import NOBODY, Bystanders
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.scene.scene import Scene

NO_ERRORS = DepthErrorParams()
GLASS = frozenset({"window", "mirror"})  # categories whose surfaces send the light elsewhere
NEIGHBOURS = np.ones((3, 3), np.uint8)


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
    """Captures RGB-D images of one scene, whose surfaces decide where depth has errors.

    Deterministic for a generator and order of poses.
    """

    def __init__(
        self,
        scene: Scene,
        renderer: SceneRenderer,
        params: CameraParams,
        rng: np.random.Generator,
        errors: DepthErrorParams = NO_ERRORS,
    ) -> None:
        self._renderer, self._params, self._rng, self._errors = renderer, params, rng, errors
        self._without_return = faces_without_return(scene, errors)
        self.intrinsics = params.intrinsics
        self.T_body_camera = params.mount

    def capture(self, T_map_body: F64, people: Bystanders = NOBODY) -> RgbdImage:
        """The image from the body's pose (4, 4)."""
        p, errors, rng = self._params, self._errors, self._rng
        view = self._renderer.render(
            T_map_body @ self.T_body_camera,
            self.intrinsics,
            width=p.width,
            height=p.height,
            people=people,
        )
        depth = view.depth_m
        if errors.noise_m > 0:
            depth = noisy_depth(depth, errors.noise_m, rng)
        if errors != NO_ERRORS:
            depth = with_depth_errors(depth, view.faces, self._without_return, errors, rng)
        return RgbdImage(view.rgb, measured_mm(depth, p.min_depth_m, p.max_depth_m))


def noisy_depth(depth_m: F32, noise_m: float, rng: np.random.Generator) -> F32:
    """Depth (H, W) with Gaussian errors of ``noise_m`` times the square of the depth in metres."""
    error = rng.standard_normal(depth_m.shape, np.float32)
    noisy: F32 = depth_m + np.float32(noise_m) * depth_m**2 * error
    return noisy


def faces_without_return(scene: Scene, params: DepthErrorParams) -> Bool:
    """Whether (F + 1,) each face gives no depth; the last row is for rays that hit nothing."""
    without = np.zeros(len(scene.faces), bool)
    if params.dark_below > 0:
        means = np.array([texture.mean() for texture in scene.textures])
        without |= means[scene.face_texture] < params.dark_below
    if params.glass:
        glass = np.array([thing.category in GLASS for thing in scene.objects], bool)
        without |= glass[scene.face_object]
    return np.append(without, False)


def with_depth_errors(
    depth_m: F32,
    faces: I32,
    without_return: Bool,
    params: DepthErrorParams,
    rng: np.random.Generator,
) -> F32:
    """Depth (H, W) float32 in metres with errors; 0 is no return.

    faces (H, W): the face each pixel shows, -1 for none; without_return (F + 1,).
    """
    measured = _with_edges(depth_m, params, rng)
    measured = np.where(without_return[faces], np.float32(0), measured)
    return quantised(measured, params.step_m) if params.step_m > 0 else measured


def depth_edges(depth_m: F32) -> Bool:
    """Pixels (H, W) at which depth jumps, by more than EDGE_JUMP of it, or ends.

    The inverse depth of a plane is linear over the image, so that its second differences vanish
    on planes, however slanted.
    """
    inverse = 1.0 / np.where(depth_m > 0, depth_m, np.float32(np.inf))
    padded = np.pad(inverse, 1, mode="reflect", reflect_type="odd")
    rows = padded[2:, 1:-1] + padded[:-2, 1:-1] - 2 * inverse
    columns = padded[1:-1, 2:] + padded[1:-1, :-2] - 2 * inverse
    bend = np.maximum(np.abs(rows), np.abs(columns))
    edges: Bool = (bend > EDGE_JUMP * inverse) & (depth_m > 0)
    return edges


def quantised(depth_m: F32, step_m: float) -> F32:
    """Depth in steps of ``step_m`` times its square: evenly spaced in disparity, 1 / depth."""
    disparity = np.rint(1.0 / (step_m * np.maximum(depth_m, np.float32(1e-3))))
    steps: F32 = np.where(depth_m > 0, 1.0 / (step_m * np.maximum(disparity, 1.0)), 0.0).astype(
        np.float32
    )
    return steps


def _with_edges(depth_m: F32, params: DepthErrorParams, rng: np.random.Generator) -> F32:
    if not (params.edge_flying or params.edge_holes):
        return depth_m
    edges = depth_edges(depth_m)
    count = int(edges.sum())
    chance, between = rng.random((2, count), np.float32)
    near = cv2.erode(depth_m, NEIGHBOURS)[edges]
    far = cv2.dilate(depth_m, NEIGHBOURS)[edges]
    flying = chance < params.edge_flying
    holes = ~flying & (chance < params.edge_flying + params.edge_holes)
    at_edges = np.where(flying, near + between * (far - near), depth_m[edges])
    measured: F32 = depth_m.copy()
    measured[edges] = np.where(holes, np.float32(0), at_edges)
    return measured


def measured_mm(depth_m: F32, min_depth_m: float, max_depth_m: float) -> U16:
    """Depth (H, W) as uint16 millimetres; 0 where it is out of the camera's range."""
    in_range = (depth_m >= min_depth_m) & (depth_m <= max_depth_m)
    millimetres: U16 = np.where(in_range, np.rint(depth_m * 1000), 0).astype(np.uint16)
    return millimetres
