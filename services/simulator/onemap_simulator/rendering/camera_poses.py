"""Random camera poses in the free space of a scene, for images to train and to measure on.

Half of the poses have any heading; the other half show an object, each category
equally often, so that small and rare objects are represented.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F32, F64, I64, camera_mount, pose_2d
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.ray_tracer import RayTracer
from onemap_simulator.scene.scene import STRUCTURE, Scene

CLEARANCE_M = 0.25  # a little more than a robot's radius
MIN_DEPTH_M = 0.7  # at the middle of the image: nearer shows only a patch of wall
LOOK_DISTANCE_M = (0.8, 4.0)
LOOK_JITTER_RAD = 0.2  # so that the object is not always in the middle
MAX_LOOK_PITCH_RAD = 0.8
ATTEMPTS = 24  # places tried per pose; after that the object counts as hidden


@dataclass(frozen=True, slots=True)
class CameraPoseRange:
    """Ranges of camera height (metres) and pitch (radians, positive looks down)."""

    camera_height_m: tuple[float, float] = (0.8, 1.3)
    pitch_rad: tuple[float, float] = (-0.1, 0.5)


def sample_camera_poses(
    scene: Scene, rng: np.random.Generator, count: int, limits: CameraPoseRange | None = None
) -> list[F64]:
    """``count`` poses T_map_camera (4, 4) in free space that the robot's start can reach."""
    limits = limits or CameraPoseRange()
    collision = CollisionMap.of(scene, limits.camera_height_m[1])
    reachable = collision.reachable_cells(scene.start[0], scene.start[1], CLEARANCE_M)
    if not reachable.any():
        raise ValueError(f"scene {scene.name}: no free space around its start {scene.start}")
    sampler = _PoseSampler(
        scene, RayTracer(scene), collision.grid.centres(np.argwhere(reachable)), limits, rng
    )
    poses = [sampler.view_of_object() if index % 2 else None for index in range(count)]
    return [sampler.random_view() if pose is None else pose for pose in poses]


@dataclass(frozen=True, slots=True)
class _PoseSampler:
    """``places`` (N, 2) metres: the floor positions to choose from."""

    scene: Scene
    tracer: RayTracer
    places: F64
    limits: CameraPoseRange
    rng: np.random.Generator

    def random_view(self) -> F64:
        """A view in any direction, of several the one with the most free depth ahead."""
        poses = []
        for place in self.rng.choice(self.places, ATTEMPTS):
            yaw = self.rng.uniform(-np.pi, np.pi)
            height = self.rng.uniform(*self.limits.camera_height_m)
            pitch = self.rng.uniform(*self.limits.pitch_rad)
            poses.append(pose_2d(place[0], place[1], yaw) @ camera_mount(0.0, height, pitch))
        eyes = np.array([pose[:3, 3] for pose in poses], np.float32)
        ahead = np.array([pose[:3, 2] for pose in poses], np.float32)
        depth = self.tracer.first_hits(eyes, ahead).distance
        return poses[int(np.argmax(np.minimum(depth, MIN_DEPTH_M)))]

    def view_of_object(self) -> F64 | None:
        """A view of a random object, None if no place tried sees the chosen point of it."""
        index = self._random_object()
        if index is None:
            return None
        faces: I64 = np.flatnonzero(self.scene.face_object == index)
        face = self.rng.choice(faces)
        target = self.scene.vertices[self.scene.faces[face]].mean(axis=0)
        apart = np.linalg.norm(self.places - target[:2], axis=1)
        near = self.places[(apart >= LOOK_DISTANCE_M[0]) & (apart <= LOOK_DISTANCE_M[1])]
        if len(near) == 0:
            return None
        chosen = self.rng.choice(near, ATTEMPTS)
        heights = self.rng.uniform(*self.limits.camera_height_m, ATTEMPTS)
        eyes = np.column_stack([chosen, heights]).astype(np.float32)
        hits = self.tracer.first_hits(eyes, target - eyes)
        seen = np.flatnonzero((hits.face >= 0) & (self.scene.face_object[hits.face] == index))
        return self._look(eyes[seen[0]], target) if len(seen) else None

    def _random_object(self) -> int | None:
        """An object that is not structure: first a category, then one of its objects."""
        by_category: dict[str, list[int]] = {}
        for index, obj in enumerate(self.scene.objects):
            if obj.category not in STRUCTURE:
                by_category.setdefault(obj.category, []).append(index)
        if not by_category:
            return None
        return int(self.rng.choice(by_category[str(self.rng.choice(sorted(by_category)))]))

    def _look(self, eye: F32, target: F32) -> F64:
        """T_map_camera of an eye (3,) that looks at a target (3,), with jitter (3,)."""
        ahead = (target - eye).astype(np.float64)
        yaw_jitter, pitch_jitter = self.rng.uniform(-LOOK_JITTER_RAD, LOOK_JITTER_RAD, 2)
        yaw = np.arctan2(ahead[1], ahead[0]) + yaw_jitter
        pitch = np.arctan2(-ahead[2], np.hypot(ahead[0], ahead[1])) + pitch_jitter
        mount = camera_mount(
            0.0, float(eye[2]), float(np.clip(pitch, -MAX_LOOK_PITCH_RAD, MAX_LOOK_PITCH_RAD))
        )
        return pose_2d(float(eye[0]), float(eye[1]), float(yaw)) @ mount
