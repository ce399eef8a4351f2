"""Habitat's agent as a robot on the bus, and the thread that Habitat has for itself."""

from __future__ import annotations

from functools import wraps
from typing import Any

import numpy as np

from onemap_shared.clock import SystemClock
from onemap_shared.command_gate import CommandGate, Deadman
from onemap_shared.geometry import F64, Velocity2d, yaw_of
from onemap_shared.keys import ROBOT_CMD_VEL, ROBOT_ODOMETRY, ROBOT_RGBD
from onemap_shared.messages import Odometry, RgbdFrame
from onemap_shared.transport import Bus, Health
from onemap_simulator.config import ODOMETRY_HZ
from onemap_simulator.rendering.rgbd_camera import measured_mm
from onemap_simulator.service import StampedPose
from onemap_tools.bench.habitat.world import (
    AgentImage,
    HabitatWorld,
    as_point,
    body_pose,
    habitat_rotation,
    to_habitat,
)

MAX_STEP_S = 0.05  # at 0.7 m/s 35 mm: an arc is that near to its chord
BLOCKED_M = 1e-3  # the navigation mesh stopped a step that ends so far from where it should
IMPACT_MPS = 0.05  # below this speed, contact is not counted


class InOneThread:
    """Stands for an object, all calls of which run in one thread: Habitat renders in it."""

    def __init__(self, thing: object) -> None:
        self._thing = thing
        self._thread = SystemClock().pool(1, "habitat")

    def __getattr__(self, name: str) -> Any:
        value = self._thread.submit(getattr, self._thing, name).result()
        if not callable(value):
            return value

        @wraps(value)
        def call(*args: Any, **kwargs: Any) -> Any:
            return self._thread.submit(value, *args, **kwargs).result()

        return call


class HabitatRobot:
    """The agent's body; a new one for each episode.

    The agent must stand at the start of its episode: its height becomes the map's z = 0.
    """

    def __init__(self, world: HabitatWorld) -> None:
        self._world, self._params = world, world.params
        self.floor_y_m = world.pose[0][1]
        self.collided = self._touches = False
        self.contacts = 0

    @property
    def pose(self) -> F64:
        """T_map_body (4, 4)."""
        return body_pose(*self._world.pose, self.floor_y_m)

    def advance(self, command: Velocity2d, seconds: float) -> None:
        """Drive along the command's arc; ``collided``: whether an obstacle stopped it."""
        p = self._params
        linear_mps = float(np.clip(command.linear_mps, -p.max_linear_mps, p.max_linear_mps))
        turn = float(np.clip(command.angular_radps, -p.max_angular_radps, p.max_angular_radps))
        self.collided = False
        steps = int(np.ceil(seconds / MAX_STEP_S - 1e-6))
        for _ in range(steps if linear_mps or turn else 0):
            self._drive(linear_mps, turn, seconds / steps)

    def _drive(self, linear_mps: float, turn_radps: float, dt_s: float) -> None:
        T_map_body = self.pose
        yaw, turned = yaw_of(T_map_body), turn_radps * dt_s
        heading = yaw + turned / 2
        chord_m = linear_mps * dt_s * float(np.sinc(turned / 2 / np.pi))  # sinc has pi in it
        goal = T_map_body[:3, 3] + [chord_m * np.cos(heading), chord_m * np.sin(heading), 0.0]
        target = to_habitat(goal, self.floor_y_m)
        reached = self._world.move(as_point(target), habitat_rotation(yaw + turned))
        off_m = float(np.hypot(reached[0] - target[0], reached[2] - target[2]))
        touched, self._touches = self._touches, off_m > BLOCKED_M
        self.collided |= self._touches
        if self._touches and not touched and abs(linear_mps) > IMPACT_MPS:
            self.contacts += 1


class HabitatDriver:
    """Obeys velocities, tells odometry without errors, sends frames; a worker.

    pose: the newest that it has told; image: the newest, with what only the benchmark may know.
    """

    def __init__(self, bus: Bus, world: HabitatWorld, rgbd_hz: float) -> None:
        self._world, self._clock, self._rgbd_s = world, bus.clock, 1.0 / rgbd_hz
        self.robot = HabitatRobot(world)
        self.image: AgentImage | None = None
        self._commands = bus.subscribe(ROBOT_CMD_VEL)
        self._gate, self._deadman = CommandGate(bus.instance), Deadman()
        self._odometry, self._frames = bus.publish(ROBOT_ODOMETRY), bus.publish(ROBOT_RGBD)
        self._told = self._captured = 0
        self._collided = False
        self._now_s = self._odometry_due_s = self._rgbd_due_s = self._clock.monotonic_s()
        self.pose = self._stamped()

    def step(self, timeout_s: float) -> None:
        """Wait for a command for at most one step, then drive up to now."""
        command = self._commands.take(min(timeout_s, MAX_STEP_S))
        now_s = self._clock.monotonic_s()
        velocity = self._deadman.command_at(self._now_s)
        self.robot.advance(velocity, now_s - self._now_s)
        self._now_s, self._collided = now_s, self._collided or self.robot.collided
        if command is not None:
            self._gate, allowed = self._gate.receive(command, now_s, self._clock.wall_ns())
            if allowed is not None:
                valid_s = allowed.validity_ms / 1e3
                self._deadman = self._deadman.with_command(allowed.velocity, now_s, valid_s)
        if now_s >= self._odometry_due_s:
            self._odometry_due_s += 1.0 / ODOMETRY_HZ
            self.pose = self._stamped()
            self._tell(velocity, now_s)
        if now_s >= self._rgbd_due_s:
            self._rgbd_due_s += self._rgbd_s
            self._send()

    def health(self) -> Health:
        """Ready once the first image was sent."""
        return Health(self._captured > 0, "" if self._captured else "it renders its first image")

    def close(self) -> None:
        """Nothing: the world is of the benchmark."""

    def _stamped(self) -> StampedPose:
        T_map_body = self.robot.pose
        return StampedPose(self._clock.wall_ns(), T_map_body, T_map_body)

    def _tell(self, velocity: Velocity2d, now_s: float) -> None:
        planner, sequence = self._gate.echo(now_s)
        odometry = Odometry(
            self._told,
            self.pose.stamp_ns,
            self.pose.T_reported,
            velocity.linear_mps,
            velocity.angular_radps,
            collided=self._collided,
            planner=planner,
            command_sequence=sequence,
            driver=self._gate.driver,
        )
        self._odometry.put(odometry)
        self._told += 1
        self._collided = False

    def _send(self) -> None:
        p, self.image, pose = self._world.params, self._world.capture(), self._stamped()
        depth_mm = measured_mm(self.image.depth_m, p.min_depth_m, p.max_depth_m)
        T_map_camera = pose.T_reported @ p.mount
        image = self.image.rgb, depth_mm, p.intrinsics, T_map_camera
        self._frames.put(RgbdFrame(self._captured, pose.stamp_ns, *image))
        self._captured += 1
