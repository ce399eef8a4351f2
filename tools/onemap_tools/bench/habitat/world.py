"""Habitat-Sim as the world of one agent, in Habitat's coordinates, and their way to the map's.

Habitat: metres, x right, y up, z backward; an agent without rotation looks along -z; rotations are
quaternions (x, y, z, w). Map: metres, x forward, y left, z up, floor at z = 0. The map of an
episode has Habitat's origin seen from above, and the height of the start as z = 0:

    x_map = -z_habitat,  y_map = -x_habitat,  z_map = y_habitat - floor_y_m.

``habitat_sim`` is imported when a world is made, not before: everything else is tested without it.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, I64, U8, camera_mount

Point = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
SENSORS = ("color", "depth", "semantic")  # our names; Habitat's types are these in capitals
SEED = 0  # of Habitat's own generator; nothing here draws from it

# Rows: the map's x, y, z axes in Habitat's axes. A proper rotation, the same for agent and body.
R_MAP_HABITAT: F64 = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def to_habitat(points_map: F64, floor_y_m: float) -> F64:
    """Points (..., 3) of the map, whose floor is at ``floor_y_m`` in Habitat, there."""
    points: F64 = (np.asarray(points_map) + [0.0, 0.0, floor_y_m]) @ R_MAP_HABITAT
    return points


def body_pose(position: Point, rotation: Quaternion, floor_y_m: float) -> F64:
    """T_map_body (4, 4) of an agent at a position with a unit rotation, both Habitat's."""
    T = np.eye(4)
    T[:3, :3] = R_MAP_HABITAT @ Rotation.from_quat(rotation).as_matrix() @ R_MAP_HABITAT.T
    T[:3, 3] = R_MAP_HABITAT @ position - [0.0, 0.0, floor_y_m]
    return T


def habitat_rotation(yaw_rad: float) -> Quaternion:
    """Habitat's rotation of an upright agent that heads ``yaw_rad`` to the left of the map's x."""
    return (0.0, float(np.sin(yaw_rad / 2)), 0.0, float(np.cos(yaw_rad / 2)))


@dataclass(frozen=True, slots=True)
class AgentParams:
    """Body and level RGB-D camera: the challenge's body and depth, the paper's camera, the
    simulator's limits of speed."""

    radius_m: float = 0.18
    height_m: float = 0.88
    camera_height_m: float = 0.88
    width: int = 640
    height: int = 640
    horizontal_fov_deg: float = 90.0
    min_depth_m: float = 0.5
    max_depth_m: float = 5.0
    max_linear_mps: float = 0.7
    max_angular_radps: float = 1.6

    @property
    def intrinsics(self) -> Intrinsics:
        """Square pixels, the principal point in the middle of the image."""
        fov_rad = float(np.radians(self.horizontal_fov_deg))
        return Intrinsics.from_fov(self.width, self.height, fov_rad)

    @property
    def mount(self) -> F64:
        """T_body_camera (4, 4): level, above the turning axis."""
        return camera_mount(0.0, self.camera_height_m, 0.0)


@dataclass(frozen=True, slots=True)
class AgentImage:
    """What the agent sees: rgb (H, W, 3) uint8; depth_m (H, W) float32 along the optical axis, 0 or
    infinite where nothing is; semantic_ids (H, W) of objects, 0 = none or not annotated."""

    rgb: U8
    depth_m: F32
    semantic_ids: I64


@dataclass(frozen=True, slots=True)
class AnnotatedBox:
    """An annotated object and the corners of its axis-aligned box."""

    semantic_id: int
    category: str
    lower: Point
    upper: Point


def habitat_sim() -> Any:
    """The module; ValueError that says what to install."""
    try:
        return importlib.import_module("habitat_sim")
    except ImportError as problem:
        raise ValueError(
            f"Habitat-Sim cannot be imported ({problem}): build it (MIT licence) for this Python "
            "from github.com/facebookresearch/habitat-sim, because its conda packages are for "
            "Python 3.9 and OneMap needs 3.10, and get the HM3D scenes from Matterport, whose "
            "terms allow academic use only."
        ) from problem


class HabitatWorld:
    """One scene at a time with one agent in it. One thread may use it: Habitat renders in it."""

    def __init__(self, params: AgentParams) -> None:
        self.params = params
        self._habitat = habitat_sim()
        self._sim: Any = None
        self._opened: tuple[Path, Path] | None = None

    def open(self, scene: Path, config: Path) -> None:
        """Load a scene with its annotations unless it is open; ValueError if that fails."""
        if self._opened == (scene, config):
            return
        for file, what in ((scene, "scene"), (config, "annotations of the scenes")):
            if not file.is_file():
                raise ValueError(f"there is no {file}, the {what}: --scenes is the folder above")
        self.close()
        self._sim = self._habitat.Simulator(self._configuration(scene, config))
        if not self._sim.pathfinder.is_loaded:
            self.close()
            raise ValueError(f"{scene} has no navigation mesh beside it: nothing can drive there")
        self._opened = (scene, config)

    def place(self, position: Point, rotation: Quaternion) -> None:
        """Put the agent there."""
        self._sim.initialize_agent(0, self._state(position, rotation))

    def move(self, position: Point, rotation: Quaternion) -> Point:
        """Move the agent straight towards a position, as far as the floor allows without sliding
        along obstacles, and turn it; returns where it is."""
        start = np.array(self.pose[0], np.float32)
        end = self._sim.pathfinder.try_step_no_sliding(start, np.array(position, np.float32))
        reached = as_point(end)
        self._sim.get_agent(0).set_state(self._state(reached, rotation))
        return reached

    @property
    def pose(self) -> tuple[Point, Quaternion]:
        """Where the agent is."""
        state = self._sim.get_agent(0).get_state()
        q = state.rotation
        return as_point(state.position), (float(q.x), float(q.y), float(q.z), float(q.w))

    def capture(self) -> AgentImage:
        """What it sees."""
        seen = self._sim.get_sensor_observations()
        return AgentImage(
            np.ascontiguousarray(seen["color"][..., :3], np.uint8),
            np.asarray(seen["depth"], np.float32),
            np.asarray(seen["semantic"], np.int64),
        )

    def path_m(self, start: Point, ends: F64) -> float:
        """Length of the shortest path to the nearest of (N, 3) places; infinity without one."""
        path = self._habitat.MultiGoalShortestPath()
        path.requested_start = np.array(start, np.float32)
        path.requested_ends = np.array(ends, np.float32)
        found = self._sim.pathfinder.find_path(path)
        return float(path.geodesic_distance) if found else float("inf")

    def boxes(self) -> tuple[AnnotatedBox, ...]:
        """All annotated objects of the scene."""
        annotated = self._sim.semantic_scene.objects
        return tuple(_box(each) for each in annotated if each is not None and each.category)

    def close(self) -> None:
        """Unload the scene."""
        if self._sim is not None:
            self._sim.close()
        self._sim = self._opened = None

    def _configuration(self, scene: Path, config: Path) -> Any:
        habitat, p = self._habitat, self.params
        backend = habitat.SimulatorConfiguration()
        backend.scene_id = str(scene)
        backend.scene_dataset_config_file = str(config)
        backend.allow_sliding = False
        backend.random_seed = SEED
        agent = habitat.agent.AgentConfiguration()
        agent.radius, agent.height = p.radius_m, p.height_m
        agent.sensor_specifications = []
        for name in SENSORS:
            sensor = habitat.CameraSensorSpec()
            sensor.uuid = name
            sensor.sensor_type = getattr(habitat.SensorType, name.upper())
            sensor.resolution = [p.height, p.width]
            sensor.hfov = p.horizontal_fov_deg
            sensor.position = np.array([0.0, p.camera_height_m, 0.0])
            agent.sensor_specifications.append(sensor)
        return habitat.Configuration(backend, [agent])

    def _state(self, position: Point, rotation: Quaternion) -> Any:
        return self._habitat.AgentState(np.array(position, np.float32), list(rotation))


def _box(annotated: Any) -> AnnotatedBox:
    """The box of an object; its centre and sizes are methods or values, as the version has it."""
    aabb = annotated.aabb
    pair = (aabb.center, aabb.size if hasattr(aabb, "size") else aabb.sizes)
    centre, size = (np.array(each() if callable(each) else each, np.float64) for each in pair)
    name = str(annotated.category.name())
    lower, upper = as_point(centre - size / 2), as_point(centre + size / 2)
    return AnnotatedBox(int(annotated.semantic_id), name, lower, upper)


def as_point(values: Any) -> Point:
    """The three values of an array or a vector of Habitat's."""
    x, y, z = (float(value) for value in np.array(values))
    return x, y, z
