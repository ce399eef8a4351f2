"""A module with the parts of ``habitat_sim`` that the benchmark uses, over a scene of ours.

The scene has z up, as all of ours; this module turns it so that y is up, as Habitat has it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.label_renderer import LabelRenderer
from onemap_simulator.scene.scene import Scene
from tests.simulator.scenes import object_vertices

FLOOR_Y_M = 0.3  # in Habitat, of our floor at 0


@dataclass
class Spec:
    """Any of Habitat's configuration objects: attributes are set from outside."""

    uuid: str = ""
    sensor_type: str = ""


@dataclass
class AgentState:
    position: Any
    rotation: Any


@dataclass
class FakeHabitat:
    """The module. ``methods``: whether boxes have methods, as in newer versions, or values."""

    scene: Scene
    has_mesh: bool = True
    methods: bool = True
    made: list[Simulator] = field(default_factory=list)

    AgentState = AgentState
    SimulatorConfiguration = Spec
    CameraSensorSpec = Spec
    MultiGoalShortestPath = Spec
    SensorType = SimpleNamespace(COLOR="c", DEPTH="d", SEMANTIC="s")
    agent = SimpleNamespace(AgentConfiguration=Spec)

    def Configuration(self, backend: Any, agents: list[Any]) -> Any:  # noqa: N802
        return SimpleNamespace(backend=backend, agents=agents)

    def Simulator(self, configuration: Any) -> Simulator:  # noqa: N802
        self.made.append(Simulator(self, configuration))
        return self.made[-1]


class Simulator:
    def __init__(self, habitat: FakeHabitat, configuration: Any) -> None:
        self.configuration = configuration
        (self._agent,) = configuration.agents
        self._scene = habitat.scene
        self._renderer = LabelRenderer(habitat.scene)
        self._floor = CollisionMap.of(habitat.scene, self._agent.height)
        self._state = AgentState(np.zeros(3), None)
        self.closed = False
        self.pathfinder = SimpleNamespace(
            is_loaded=habitat.has_mesh,
            try_step_no_sliding=self._try_step,
            find_path=self._find_path,
        )
        objects = [self._annotated(index, habitat.methods) for index in range(len(self._names))]
        self.semantic_scene = SimpleNamespace(objects=[*objects, None])

    @property
    def _names(self) -> list[str]:
        return [thing.category for thing in self._scene.objects]

    def initialize_agent(self, agent_id: int, state: AgentState) -> None:
        assert agent_id == 0
        self.set_state(state)

    def get_agent(self, agent_id: int) -> Simulator:
        assert agent_id == 0
        return self

    def get_state(self) -> AgentState:
        return self._state

    def set_state(self, state: AgentState) -> None:
        assert isinstance(state.rotation, list)
        x, y, z, w = state.rotation
        self._state = AgentState(state.position, SimpleNamespace(x=x, y=y, z=z, w=w))

    def get_sensor_observations(self) -> dict[str, Any]:
        spec = self._agent.sensor_specifications[0]
        (height, width), fov_rad = spec.resolution, float(np.radians(spec.hfov))
        intrinsics = Intrinsics.from_fov(width, height, fov_rad)
        image = self._renderer.render(self._camera_pose(), intrinsics, width=width, height=height)
        opaque = np.full((height, width, 1), 255, np.uint8)
        return {
            "color": np.concatenate([image.rgb, opaque], axis=-1),
            "depth": image.depth_m,
            "semantic": (image.labels + 1).astype(np.uint32),
        }

    def close(self) -> None:
        self.closed = True

    def _camera_pose(self) -> Any:
        """Position and heading taken apart, independently of the code under test."""
        q = self._state.rotation
        yaw = 2 * np.arctan2(q.y, q.w)
        T = np.eye(4)
        ahead, left = (np.cos(yaw), np.sin(yaw), 0.0), (-np.sin(yaw), np.cos(yaw), 0.0)
        T[:3, 0], T[:3, 1], T[:3, 2] = -np.array(left), (0.0, 0.0, -1.0), ahead
        height = self._agent.sensor_specifications[0].position[1]
        T[:3, 3] = (*self._seen_from_above(self._state.position), height)
        return T

    @staticmethod
    def _seen_from_above(position: Any) -> tuple[float, float]:
        return -float(position[2]), -float(position[0])

    def _try_step(self, start: Any, end: Any) -> Any:
        for share in np.linspace(1, 0, 20):
            place = start + share * (end - start)
            if self._floor.clearance_m(*self._seen_from_above(place)) >= self._agent.radius:
                return place
        return start

    def _find_path(self, path: Any) -> bool:
        lengths = np.linalg.norm(path.requested_ends - path.requested_start, axis=1)
        path.geodesic_distance = lengths.min()
        return bool(path.geodesic_distance < 100)

    def _annotated(self, index: int, methods: bool) -> Any:
        corners = object_vertices(self._scene, index)
        low, high = corners.min(axis=0), corners.max(axis=0)
        centre, size = (low + high) / 2, high - low
        centre = np.array([-centre[1], centre[2] + FLOOR_Y_M, -centre[0]])
        size = np.array([size[1], size[2], size[0]])
        aabb = SimpleNamespace(center=centre, sizes=size)
        if methods:
            aabb = SimpleNamespace(center=lambda: centre, size=lambda: size)
        category = SimpleNamespace(name=lambda: self._names[index])
        return SimpleNamespace(semantic_id=index + 1, category=category, aabb=aabb)
