"""The simulator's robot and camera in simulated time, and how it truly was."""

from __future__ import annotations

from dataclasses import dataclass

from onemap_shared.geometry import F64, Velocity2d
from onemap_shared.messages import RgbdFrame
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.errors.localisation import true_place
from onemap_simulator.parts import RobotParts
from onemap_simulator.physics.people import Bystanders
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import SceneRenderer
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.simulated_stamps import stamp_of

COMMAND_VALID_S = 0.3  # as ``VelocityCommand`` has it by default


@dataclass(frozen=True, slots=True)
class FrameTruth:
    """Of a frame: the true T_map_camera (4, 4) of its capture, and where people were then."""

    T_map_camera: F64
    people: Bystanders


@dataclass(frozen=True, slots=True)
class SearchEnd:
    """Reported and true T_map_body (4, 4) when the search for an object ended."""

    T_reported: F64
    T_true: F64

    def true_place(self, place: tuple[float, ...]) -> tuple[float, ...]:
        """Where a place (x, y, ...) truly is that the search told at that time; empty if it is."""
        if not place:
            return place
        return (*true_place(self.T_reported, self.T_true, place), *place[2:])


class SimulatedRobot:
    """The simulator's robot and camera in simulated time."""

    def __init__(
        self, scene: Scene, config: SimulatorConfig, renderer: SceneRenderer | None = None
    ) -> None:
        parts = RobotParts.of(scene, config, renderer or Renderer(scene), now_s=0.0)
        self.localisation, self.link = parts.localisation, parts.link
        self._simulation, self._camera = parts.simulation, parts.camera
        self._frames = 0
        self._truths: dict[int, FrameTruth] = {}  # by the frame's sequence
        self.collided = False

    @property
    def xy(self) -> tuple[float, float]:
        """True position in the map, metres."""
        T_map_body = self._simulation.state.pose
        return float(T_map_body[0, 3]), float(T_map_body[1, 3])

    @property
    def speed_mps(self) -> float:
        """True forward speed, m/s."""
        return self._simulation.state.velocity.linear_mps

    @property
    def contacts(self) -> int:
        """How often an obstacle stopped the robot from above ``IMPACT_MPS``."""
        return self._simulation.counts.collisions

    @property
    def people_touched(self) -> int:
        """How many of the contacts were with people."""
        return self._simulation.counts.people_touched

    @property
    def edges_crossed(self) -> int:
        """How often the robot's disc came over a place without floor."""
        return self._simulation.counts.edges_crossed

    def advance(self, command: Velocity2d, before_s: float, now_s: float) -> None:
        """Move until ``now_s`` under a command received at ``before_s``."""
        self._simulation.receive_command(command, before_s, COMMAND_VALID_S)
        self.collided = self._simulation.advance(now_s)

    @property
    def pose(self) -> F64:
        """True T_map_body (4, 4)."""
        return self._simulation.state.pose

    def odometry(self) -> F64:
        """T_map_body (4, 4) as odometry reports it: with the configured errors."""
        return self.localisation.reported(self.pose)

    def frames(self, now_s: float, *, capture: bool) -> list[RgbdFrame]:
        """The frames that arrived up to ``now_s``, after another was captured if it is due."""
        if capture:
            self.link.send(self.frame(now_s), now_s)
        return self.link.arrived(now_s)

    def truth_of(self, frame: RgbdFrame) -> FrameTruth:
        """How it truly was when the frame was captured."""
        return self._truths[frame.sequence]

    def frame(self, now_s: float) -> RgbdFrame:
        """The camera's frame at ``now_s``."""
        people = self._simulation.bystanders
        image = self._camera.capture(self.pose, people)
        self._frames += 1
        T_map_camera = self.pose @ self._camera.T_body_camera
        self._truths[self._frames] = FrameTruth(T_map_camera, people)
        return RgbdFrame(
            self._frames,
            stamp_of(now_s),
            image.rgb,
            image.depth_mm,
            self._camera.intrinsics,
            self.odometry() @ self._camera.T_body_camera,
        )
