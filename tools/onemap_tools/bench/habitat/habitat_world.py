"""Habitat-Sim as the world: scenes, the agent's sensors, its navigation mesh and annotations.

Imports ``habitat_sim`` when a world is made, not before: everything else of the benchmark is
tested without it. One thread may use a world: Habitat renders in the thread that opened the scene.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from onemap_shared.geometry import F64
from onemap_tools.bench.habitat.coordinates import Point, Quaternion
from onemap_tools.bench.habitat.params import HabitatRobotParams
from onemap_tools.bench.habitat.world import AgentImage, AnnotatedBox

SENSORS = ("color", "depth", "semantic")  # our names; Habitat's types are these in capitals
SEED = 0  # of Habitat's own generator; nothing here draws from it


def habitat_sim() -> Any:
    """The module; ValueError that says what to install."""
    try:
        return importlib.import_module("habitat_sim")
    except ImportError as problem:
        raise ValueError(
            f"Habitat-Sim cannot be imported ({problem}): build it (MIT licence) for this Python "
            "from github.com/facebookresearch/habitat-sim, because its conda packages are for "
            "Python 3.9 and OneMap needs 3.10, and get the HM3D scenes from Matterport, whose "
            "terms allow academic use only"
        ) from problem


class HabitatWorld:
    """Implements ``World`` with Habitat-Sim."""

    def __init__(self, params: HabitatRobotParams) -> None:
        self._params = params
        self._habitat = habitat_sim()
        self._sim: Any = None
        self._opened: tuple[Path, Path] | None = None

    def open(self, scene: Path, config: Path) -> None:
        """See ``World``; a scene that is open stays so."""
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
        """See ``World``."""
        self._sim.initialize_agent(0, self._state(position, rotation))

    def move(self, position: Point, rotation: Quaternion) -> Point:
        """See ``World``."""
        start = np.array(self.pose[0], np.float32)
        end = self._sim.pathfinder.try_step_no_sliding(start, np.array(position, np.float32))
        reached = _point(end)
        self._sim.get_agent(0).set_state(self._state(reached, rotation))
        return reached

    @property
    def pose(self) -> tuple[Point, Quaternion]:
        """See ``World``."""
        state = self._sim.get_agent(0).get_state()
        q = state.rotation
        return _point(state.position), (float(q.x), float(q.y), float(q.z), float(q.w))

    def capture(self) -> AgentImage:
        """See ``World``."""
        seen = self._sim.get_sensor_observations()
        return AgentImage(
            np.ascontiguousarray(seen["color"][..., :3], np.uint8),
            np.asarray(seen["depth"], np.float32),
            np.asarray(seen["semantic"], np.int64),
        )

    def path_m(self, start: Point, ends: F64) -> float:
        """See ``World``."""
        path = self._habitat.MultiGoalShortestPath()
        path.requested_start = np.array(start, np.float32)
        path.requested_ends = np.array(ends, np.float32)
        found = self._sim.pathfinder.find_path(path)
        return float(path.geodesic_distance) if found else float("inf")

    def boxes(self) -> tuple[AnnotatedBox, ...]:
        """See ``World``."""
        annotated = self._sim.semantic_scene.objects
        return tuple(_box(each) for each in annotated if each is not None and each.category)

    def close(self) -> None:
        """See ``World``."""
        if self._sim is not None:
            self._sim.close()
        self._sim = self._opened = None

    def _configuration(self, scene: Path, config: Path) -> Any:
        habitat, p = self._habitat, self._params
        backend = habitat.SimulatorConfiguration()
        backend.scene_id = str(scene)
        backend.scene_dataset_config_file = str(config)
        backend.allow_sliding = False
        backend.random_seed = SEED
        agent = habitat.agent.AgentConfiguration()
        agent.radius, agent.height = p.radius_m, p.height_m
        agent.sensor_specifications = [self._sensor(name) for name in SENSORS]
        return habitat.Configuration(backend, [agent])

    def _sensor(self, name: str) -> Any:
        p = self._params
        sensor = self._habitat.CameraSensorSpec()
        sensor.uuid = name
        sensor.sensor_type = getattr(self._habitat.SensorType, name.upper())
        sensor.resolution = [p.height, p.width]
        sensor.hfov = p.horizontal_fov_deg
        sensor.position = np.array([0.0, p.camera_height_m, 0.0])
        return sensor

    def _state(self, position: Point, rotation: Quaternion) -> Any:
        return self._habitat.AgentState(np.array(position, np.float32), list(rotation))


def _box(annotated: Any) -> AnnotatedBox:
    """The box of an object; its centre and sizes are methods or values, as the version has it."""
    aabb = annotated.aabb
    centre = np.array(_value(aabb.center), np.float64)
    half = np.array(_value(aabb.size if hasattr(aabb, "size") else aabb.sizes), np.float64) / 2
    return AnnotatedBox(
        int(annotated.semantic_id),
        str(annotated.category.name()),
        _point(centre - half),
        _point(centre + half),
    )


def _value(value_or_method: Any) -> Any:
    return value_or_method() if callable(value_or_method) else value_or_method


def _point(values: Any) -> Point:
    x, y, z = (float(value) for value in np.array(values))
    return x, y, z
