"""Rooms of boxes, seen by a simulated depth camera: analytic, hence exact."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, I64, U16, camera_mount, pose_2d
from onemap_shared.messages import FeatureField

CAMERA = Intrinsics.from_fov(80, 60, np.pi / 2)
SIZE = (60, 80)


@dataclass(frozen=True)
class Box:
    """Axis-aligned, metres in the map frame."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]


# A closed room 6 m x 5 m x 2.5 m with floor at z = 0: six slabs.
ROOM = (
    Box((-3.2, -2.7, -0.2), (3.2, 2.7, 0.0)),
    Box((-3.2, -2.7, 2.5), (3.2, 2.7, 2.7)),
    Box((-3.2, -2.7, 0.0), (-3.02, 2.7, 2.5)),
    Box((3.02, -2.7, 0.0), (3.2, 2.7, 2.5)),
    Box((-3.2, -2.7, 0.0), (3.2, -2.52, 2.5)),
    Box((-3.2, 2.52, 0.0), (3.2, 2.7, 2.5)),
)


def params(**changes: Any) -> MapParams:
    """The default parameters with some replaced, in float32, so that tests can be exact."""
    return replace(MapParams(feature_dtype="float32"), **changes)


def slots_of(belief: BeliefMap, cells: I64) -> I64:
    """Slots (n,) of distinct world cells (n, 2), new where there were none."""
    return belief.slots_at(belief.grow(cells), cells)


def mapped(*fields: FeatureField, params: MapParams | None = None) -> BeliefMap:
    """The map of these fields."""
    belief = BeliefMap(MapParams(feature_dtype="float32") if params is None else params)
    for each in fields:
        belief.fuse(compute_update(each, belief.params))
    return belief


def pose(x_m: float = 0.0, y_m: float = 0.0, yaw_rad: float = 0.0, height_m: float = 1.0) -> F64:
    """T_map_camera of a camera that looks 20 degrees down."""
    return pose_2d(x_m, y_m, yaw_rad) @ camera_mount(0.0, height_m, np.deg2rad(20))


def rolled(T_map_camera: F64, roll_rad: float) -> F64:
    """The pose with the camera turned about its optical axis."""
    c, s = np.cos(roll_rad), np.sin(roll_rad)
    T = np.eye(4)
    T[:2, :2] = [[c, -s], [s, c]]
    return T_map_camera @ T


def depth_of(
    boxes: tuple[Box, ...],
    T_map_camera: F64,
    intrinsics: Intrinsics = CAMERA,
    size: tuple[int, int] = SIZE,
) -> F32:
    """z-depth (H, W) float32 of boxes, 0 where a ray hits none."""
    return seen_boxes(boxes, T_map_camera, intrinsics, size)[0]


def seen_boxes(
    boxes: tuple[Box, ...],
    T_map_camera: F64,
    intrinsics: Intrinsics = CAMERA,
    size: tuple[int, int] = SIZE,
) -> tuple[F32, I64]:
    """z-depth (H, W) float32, and the index (H, W) of the box in sight; 0 and -1: none."""
    height, width = size
    x, y = intrinsics.x_at(np.arange(width)), intrinsics.y_at(np.arange(height))
    rays = np.stack(np.broadcast_arrays(x[None, :], y[:, None], 1.0), axis=-1)
    rays = np.ascontiguousarray(np.moveaxis(rays @ T_map_camera[:3, :3].T, -1, 0))
    origin = T_map_camera[:3, 3, None, None]
    nearest = np.full((height, width), np.inf)
    owner = np.full((height, width), -1)
    for index, box in enumerate(boxes):
        with np.errstate(divide="ignore", invalid="ignore"):
            one = (np.array(box.low)[:, None, None] - origin) / rays
            two = (np.array(box.high)[:, None, None] - origin) / rays
        enter = np.minimum(one, two).max(axis=0)
        leave = np.maximum(one, two).min(axis=0)
        hit = (enter <= leave) & (enter > 0)
        hit &= enter < nearest
        nearest[hit], owner[hit] = enter[hit], index
    return np.where(np.isfinite(nearest), nearest, 0).astype(np.float32), owner


def millimetres(depth_m: F32) -> U16:
    """As on the wire."""
    rounded: U16 = np.round(depth_m * 1000).astype(np.uint16)
    return rounded


def field(
    sequence: int,
    T_map_camera: F64,
    *,
    boxes: tuple[Box, ...] = ROOM,
    features: np.ndarray | None = None,
    encoder_id: str = "encoder-a",
    seed: int = 0,
) -> FeatureField:
    """A field of this scene with random unit features (6, 8, 16) unless they are given."""
    if features is None:
        features = np.random.default_rng((seed, sequence)).normal(size=(6, 8, 16))
    features = features / np.linalg.norm(features, axis=-1, keepdims=True)
    depth_m = depth_of(boxes, T_map_camera)
    variance = np.exp(((1.0 - depth_m) / 1.5) ** 2 / 3).astype(np.float32)
    return FeatureField(
        sequence=sequence,
        stamp_ns=(sequence + 1) * 200_000_000,
        encoder_id=encoder_id,
        text_space="space-a",
        features=features.astype(np.float16),
        variance=np.where(depth_m > 0, variance, np.inf).astype(np.float32),
        depth_mm=millimetres(depth_m),
        intrinsics=CAMERA,
        T_map_camera=T_map_camera,
    )
