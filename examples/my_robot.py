"""A robot of your own: publish frames and odometry, follow the velocity commands.

    python examples/my_robot.py [tcp/127.0.0.1:7447]

Replace the three methods of ``Robot`` by your driver's. This one stands in an
empty room, 3 m before a wall, so that the file runs as it is.
"""

from __future__ import annotations

import signal
import sys
import threading
import time
import uuid

import numpy as np

from onemap_shared import keys
from onemap_shared.bus import open_bus
from onemap_shared.camera import Intrinsics, ray_directions
from onemap_shared.command_gate import CommandGate
from onemap_shared.config import BusConfig
from onemap_shared.geometry import F64, U8, U16, camera_mount, pose_2d
from onemap_shared.messages import Odometry, RgbdFrame, VelocityCommand

CAMERA = Intrinsics(fx=195.0, fy=195.0, cx=160.0, cy=120.0)  # of the depth-aligned colour image
T_BODY_CAMERA = camera_mount(x_m=0.1, z_m=1.0, pitch_down_rad=0.2)  # measure these on your robot
PERIOD_S = 0.05  # odometry and commands at 20 Hz
FRAME_EVERY = 3  # a frame with every third odometry message: 7 Hz


class Robot:
    """The interface to your driver."""

    def image(self) -> tuple[U8, U16]:
        """Colour (H, W, 3) uint8 RGB and depth (H, W) uint16 millimetres, 0 = no return."""
        rays = ray_directions(CAMERA, 320, 240) @ T_BODY_CAMERA[:3, :3].T
        wall_m = (3.0 - T_BODY_CAMERA[0, 3]) / rays[..., 0]
        floor_m = T_BODY_CAMERA[2, 3] / np.maximum(-rays[..., 2], 1e-9)
        depth_mm = (1000 * np.minimum(wall_m, floor_m)).astype(np.uint16)
        return np.full((240, 320, 3), 127, np.uint8), depth_mm

    def pose(self) -> F64:
        """T_map_body (4, 4) of the moment the image was taken: x forward, y left, z up."""
        return pose_2d(0.0, 0.0, 0.0)

    def drive(self, linear_mps: float, angular_radps: float) -> None:
        """Send a velocity to the base."""


def follow(robot: Robot, command: VelocityCommand | None, silent_s: float) -> None:
    """Drive as commanded; stop 0.3 s after the last command. Never leave this out."""
    if command is not None:
        robot.drive(command.linear_mps, command.angular_radps)
    elif silent_s > 0.3:
        robot.drive(0.0, 0.0)


def main(router: str) -> None:
    """Publish and drive until Ctrl-C."""
    stop = threading.Event()
    for signum in (signal.SIGINT, signal.SIGTERM):
        signal.signal(signum, lambda *_: stop.set())
    bus = open_bus(BusConfig(connect=(router,)), "robot", uuid.uuid4().hex[:12], stop)
    if bus is None:  # stopped before there was a router
        return
    frames, odometry = bus.publish(keys.ROBOT_RGBD), bus.publish(keys.ROBOT_ODOMETRY)
    commands = bus.subscribe(keys.ROBOT_CMD_VEL)
    robot, gate, sequence, received_s = Robot(), CommandGate(bus.instance), 0, time.monotonic()
    try:
        while not stop.is_set():
            command = commands.take(PERIOD_S)  # waits up to one period
            if command is not None:  # only of one planner, and made on fresh odometry
                gate, command = gate.receive(command, time.monotonic(), time.time_ns())
            received_s = time.monotonic() if command is not None else received_s
            follow(robot, command, time.monotonic() - received_s)
            stamp_ns, pose = time.time_ns(), robot.pose()
            echo = gate.echo(time.monotonic())  # by this the planner measures its delay
            odometry.put(
                Odometry(sequence, stamp_ns, pose, 0.0, 0.0, False, *echo, driver=gate.driver)
            )
            if sequence % FRAME_EVERY == 0:
                rgb, depth_mm = robot.image()
                T_map_camera = pose @ T_BODY_CAMERA
                number = sequence // FRAME_EVERY
                frames.put(RgbdFrame(number, stamp_ns, rgb, depth_mm, CAMERA, T_map_camera))
            sequence += 1
    finally:
        robot.drive(0.0, 0.0)
        bus.close()


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "tcp/127.0.0.1:7447")
