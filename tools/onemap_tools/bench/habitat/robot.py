"""The agent in Habitat as a robot on the bus: frames and odometry out, velocity commands in.

It speaks as the simulator's robot does, so that perception, mapper and planner run unchanged. Time
is an argument: of the wall for a robot in real time, simulated for searches in lockstep. Nothing
of OneMap but ``onemap_shared`` is needed to run it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.command_gate import CommandGate
from onemap_shared.geometry import F32, F64, U16, Velocity2d, wrap_angle, yaw_of
from onemap_shared.keys import ROBOT_CMD_VEL, ROBOT_ODOMETRY, ROBOT_RGBD
from onemap_shared.messages import Odometry, RgbdFrame, VelocityCommand
from onemap_shared.transport import Bus
from onemap_tools.bench.habitat.coordinates import (
    Point,
    body_pose,
    habitat_rotation,
    to_habitat,
)
from onemap_tools.bench.habitat.params import HabitatRobotParams
from onemap_tools.bench.habitat.world import AgentImage, World

MAX_STEP_S = 0.05  # at 0.7 m/s 35 mm: an arc is that near to its chord
BLOCKED_M = 1e-3  # the navigation mesh stopped a step that ends so far from where it should
IMPACT_MPS = 0.05  # below this speed, contact is not counted
MAX_PAUSE_S = 1.0  # caught up with at most after a pause, such as rendering that took longer


@dataclass(frozen=True, slots=True)
class PlanarPose:
    """Position in the map, metres, and heading, radians; z follows the floor."""

    x_m: float
    y_m: float
    z_m: float
    yaw_rad: float


class HabitatRobot:
    """Publishes what the agent sees and where it is, and drives as it is commanded."""

    def __init__(self, bus: Bus, world: World, params: HabitatRobotParams, *, now_s: float) -> None:
        """The agent must stand at the start of its episode: its height becomes the map's z = 0."""
        self._world, self._params = world, params
        self.floor_y_m = world.pose[0][1]
        self._commands = bus.subscribe(ROBOT_CMD_VEL)
        self._odometry = bus.publish(ROBOT_ODOMETRY)
        self._frames = bus.publish(ROBOT_RGBD)
        self._now_s = now_s
        self._gate = CommandGate()
        self._command, self._expires_s = Velocity2d(), now_s
        self._velocity = Velocity2d()
        self._collided = self._touches = False
        self._sequences = {"odometry": 0, "frame": 0}
        self.contacts = 0
        self.image: AgentImage | None = None

    @property
    def pose(self) -> F64:
        """True T_map_body (4, 4)."""
        return body_pose(*self._world.pose, self.floor_y_m)

    def received(self, timeout_s: float = 0.0) -> VelocityCommand | None:
        """The newest command; None if none arrives within ``timeout_s``."""
        return self._commands.take(timeout_s)

    def obey(self, command: VelocityCommand | None, now_s: float, stamp_ns: int) -> None:
        """Follow a command that arrived at ``now_s``; None leaves the last one in force.

        stamp_ns: the same moment, by the clock that odometry is stamped with.
        """
        if command is None:
            return
        self._gate, command = self._gate.receive(command, now_s, stamp_ns)
        if command is None:
            return
        p = self._params
        self._command = Velocity2d(
            float(np.clip(command.linear_mps, -p.max_linear_mps, p.max_linear_mps)),
            float(np.clip(command.angular_radps, -p.max_angular_radps, p.max_angular_radps)),
        )
        self._expires_s = now_s + min(command.validity_ms / 1e3, p.deadman_s)

    def advance(self, now_s: float) -> None:
        """Drive up to ``now_s``; the command holds until it expires."""
        self._now_s = max(self._now_s, now_s - MAX_PAUSE_S)
        while now_s - self._now_s > 1e-6:
            dt_s = min(MAX_STEP_S, now_s - self._now_s)
            in_force = self._now_s + 1e-6 < self._expires_s
            self._velocity = self._command if in_force else Velocity2d()
            if self._velocity != Velocity2d():
                self._drive(dt_s)
            self._now_s += dt_s

    def publish_odometry(self, stamp_ns: int) -> None:
        """Where the body is and how fast it moves."""
        v = self._velocity
        planner, command_sequence = self._gate.echo(self._now_s)
        self._odometry.put(
            Odometry(
                self._next("odometry"),
                stamp_ns,
                self.pose,
                v.linear_mps,
                v.angular_radps,
                collided=self._collided,
                planner=planner,
                command_sequence=command_sequence,
            )
        )
        self._collided = False

    def publish_frame(self, stamp_ns: int) -> None:
        """What the camera sees; ``image`` keeps it with what only the benchmark may know."""
        p, self.image = self._params, self._world.capture()
        depth_mm = measured_mm(self.image.depth_m, p.min_depth_m, p.max_depth_m)
        T_map_camera = self.pose @ p.mount
        self._frames.put(
            RgbdFrame(
                self._next("frame"), stamp_ns, self.image.rgb, depth_mm, p.intrinsics, T_map_camera
            )
        )

    def _drive(self, dt_s: float) -> None:
        T_map_body = self.pose
        x, y, z = (float(value) for value in T_map_body[:3, 3])
        wanted = after(PlanarPose(x, y, z, yaw_of(T_map_body)), self._velocity, dt_s)
        target = to_habitat(np.array([wanted.x_m, wanted.y_m, wanted.z_m]), self.floor_y_m)
        reached = self._world.move(as_point(target), habitat_rotation(wanted.yaw_rad))
        off_m = float(np.hypot(reached[0] - target[0], reached[2] - target[2]))
        touched, self._touches = self._touches, off_m > BLOCKED_M
        self._collided = self._collided or self._touches
        if self._touches and not touched and abs(self._velocity.linear_mps) > IMPACT_MPS:
            self.contacts += 1

    def _next(self, stream: str) -> int:
        self._sequences[stream] += 1
        return self._sequences[stream]


def after(pose: PlanarPose, velocity: Velocity2d, dt_s: float) -> PlanarPose:
    """The pose after driving an arc at a constant velocity."""
    length, turn = velocity.linear_mps * dt_s, velocity.angular_radps * dt_s
    chord = length * float(np.sinc(turn / 2 / np.pi))  # numpy's sinc has pi in it
    heading = pose.yaw_rad + turn / 2
    return PlanarPose(
        pose.x_m + chord * float(np.cos(heading)),
        pose.y_m + chord * float(np.sin(heading)),
        pose.z_m,
        wrap_angle(pose.yaw_rad + turn),
    )


def measured_mm(depth_m: F32, min_depth_m: float, max_depth_m: float) -> U16:
    """Depth (H, W) as uint16 millimetres; 0 where it is out of the range or not finite."""
    in_range = (depth_m >= min_depth_m) & (depth_m <= max_depth_m)
    millimetres: U16 = np.rint(np.where(in_range, depth_m, 0) * 1000).astype(np.uint16)
    return millimetres


def as_point(values: F64) -> Point:
    """The three values of an array (3,)."""
    x, y, z = (float(value) for value in values)
    return x, y, z
