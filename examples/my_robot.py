"""A robot of your own: publish frames and odometry, follow the velocity commands.

    python examples/my_robot.py [tcp/127.0.0.1:7447]

Replace the three methods of ``Robot`` by your driver's. This one stands in an empty room, 3 m
before a wall, so that the file runs as it is. ``CommandFollower`` drives and brakes in a thread of
its own, the camera has another one: none of them waits for the other.
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
from onemap_shared.command_follower import CommandFollower
from onemap_shared.config import BusConfig
from onemap_shared.geometry import F64, U8, U16, Velocity2d, camera_mount, pose_2d
from onemap_shared.messages import Odometry, RgbdFrame
from onemap_shared.transport import Publisher

CAMERA = Intrinsics(fx=195.0, fy=195.0, cx=160.0, cy=120.0)  # of the depth-aligned colour image
T_BODY_CAMERA = camera_mount(x_m=0.1, z_m=1.0, pitch_down_rad=0.2)  # measure these on your robot
PERIOD_S = 0.05  # odometry at 20 Hz
FRAME_S = 0.14  # frames at 7 Hz


class Robot:
    """The interface to your driver."""

    def image(self) -> tuple[int, U8, U16]:
        """The next image: time of its capture in nanoseconds, colour (H, W, 3) uint8 RGB, and depth
        (H, W) uint16 millimetres, 0 = no return. It may wait as long as the camera does."""
        stamp_ns = time.time_ns()
        rays = ray_directions(CAMERA, 320, 240) @ T_BODY_CAMERA[:3, :3].T
        wall_m = (3.0 - T_BODY_CAMERA[0, 3]) / rays[..., 0]
        floor_m = T_BODY_CAMERA[2, 3] / np.maximum(-rays[..., 2], 1e-9)
        depth_mm = (1000 * np.minimum(wall_m, floor_m)).astype(np.uint16)
        return stamp_ns, np.full((240, 320, 3), 127, np.uint8), depth_mm

    def pose(self, stamp_ns: int) -> F64:  # noqa: ARG002 (this one stands)
        """T_map_body (4, 4) of this moment, now or that of an image: x forward, y left, z up."""
        return pose_2d(0.0, 0.0, 0.0)

    def drive(self, velocity: Velocity2d) -> None:
        """Send ``linear_mps`` and ``angular_radps`` to the base, without waiting for it."""


def send_frames(robot: Robot, frames: Publisher[RgbdFrame], stop: threading.Event) -> None:
    """Publish each image with the pose of its capture; ends the program if the camera fails."""
    sequence = 0
    try:
        while not stop.wait(FRAME_S):
            stamp_ns, rgb, depth_mm = robot.image()
            T_map_camera = robot.pose(stamp_ns) @ T_BODY_CAMERA
            frames.put(RgbdFrame(sequence, stamp_ns, rgb, depth_mm, CAMERA, T_map_camera))
            sequence += 1
    finally:
        stop.set()


def send_odometry(
    robot: Robot, follower: CommandFollower, odometry: Publisher[Odometry], stop: threading.Event
) -> None:
    """Publish the pose, with the newest command: by it the planner measures its delay."""
    sequence = 0
    try:
        while not stop.wait(PERIOD_S):
            stamp_ns = time.time_ns()
            known = Odometry(sequence, stamp_ns, robot.pose(stamp_ns), 0.0, 0.0, False)
            odometry.put(follower.named(known))
            sequence += 1
    finally:
        stop.set()


def main(router: str) -> None:
    """Publish and drive until Ctrl-C."""
    stop = threading.Event()
    for signum in (signal.SIGINT, signal.SIGTERM):
        signal.signal(signum, lambda *_: stop.set())
    bus = open_bus(BusConfig(connect=(router,)), "robot", uuid.uuid4().hex[:12], stop)
    if bus is None:  # stopped before there was a router
        return
    robot = Robot()
    follower = CommandFollower(bus, robot.drive)
    frames, odometry = bus.publish(keys.ROBOT_RGBD), bus.publish(keys.ROBOT_ODOMETRY)
    for task, arguments in (
        (send_frames, (robot, frames, stop)),
        (send_odometry, (robot, follower, odometry, stop)),
    ):
        threading.Thread(target=task, args=arguments, name=task.__name__, daemon=True).start()
    while not stop.wait(PERIOD_S) and not follower.problem:
        pass  # whatever the threads wait for
    problem = follower.problem
    follower.close()  # stops the robot, before anything else
    bus.close()
    if problem:
        sys.exit(problem)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "tcp/127.0.0.1:7447")
