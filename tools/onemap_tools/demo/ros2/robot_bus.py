"""A bus for the simulator whose robot's topics are those of a ROS 2 robot."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable
from typing import Any, TypeVar

from onemap_ros2.cdr import CAMERA_INFO, IMAGE, ODOMETRY, TF, TWIST_STAMPED, decode
from onemap_ros2.network.interface import Reader, RosNetwork
from onemap_shared.geometry import F64
from onemap_shared.keys import ROBOT_CMD_VEL, ROBOT_ODOMETRY, ROBOT_RGBD, Procedure, Topic
from onemap_shared.messages import Odometry, RgbdFrame, VelocityCommand
from onemap_shared.transport import CALL_TIMEOUT_S, Bus, Counters, Publisher, Subscription
from onemap_tools.demo.ros2 import robot_messages

M = TypeVar("M")
Q = TypeVar("Q")
R = TypeVar("R")

COLOR, DEPTH, INFO = "/camera/color/image_raw", "/camera/depth/image_raw", "/camera/camera_info"
ODOM, COMMAND = "/odom", "/cmd_vel"
BASE_TIMEOUT_MS = 500  # a base's own: without a command for so long it stops


class Ros2RobotBus:
    """Implements ``transport.Bus``: frames, odometry and commands go over ROS 2, the rest as ever.

    T_body_camera: (4, 4), where the camera is mounted; published once, latched.
    """

    def __init__(self, bus: Bus, network: RosNetwork, T_body_camera: F64) -> None:
        self._bus, self._network = bus, network
        network.write("/tf_static", TF, latched=True).put(
            robot_messages.fixed_transform(T_body_camera)
        )

    @property
    def instance(self) -> str:
        """See ``transport.Bus``."""
        return self._bus.instance

    @property
    def namespace(self) -> str:
        """See ``transport.Bus``."""
        return self._bus.namespace

    def publish(self, topic: Topic[Any]) -> Publisher[Any]:
        """See ``transport.Bus``."""
        if topic == ROBOT_RGBD:
            return _FramePublisher(self._network)
        if topic == ROBOT_ODOMETRY:
            return _OdometryPublisher(self._network)
        return self._bus.publish(topic)

    def subscribe(
        self, topic: Topic[Any], capacity: int = 1, arrived: threading.Event | None = None
    ) -> Subscription[Any]:
        """See ``transport.Bus``; a command of the robot's network sets no event."""
        if topic == ROBOT_CMD_VEL:
            reader = self._network.read(COMMAND, TWIST_STAMPED, 1)
            return _CommandSubscription(self._network, reader)
        return self._bus.subscribe(topic, capacity, arrived)

    def serve(self, procedure: Procedure[Q, R], handler: Callable[[Q], R]) -> None:
        """See ``transport.Bus``."""
        self._bus.serve(procedure, handler)

    def call(self, procedure: Procedure[Q, R], request: Q, timeout_s: float = CALL_TIMEOUT_S) -> R:
        """See ``transport.Bus``."""
        return self._bus.call(procedure, request, timeout_s)

    def alive(self) -> frozenset[str]:
        """See ``transport.Bus``."""
        return self._bus.alive()

    def members(self) -> frozenset[tuple[str, str]]:
        """See ``transport.Bus``."""
        return self._bus.members()

    def connected(self) -> bool:
        """See ``transport.Bus``."""
        return self._bus.connected()

    def sibling(self, namespace: str) -> Bus:
        """See ``transport.Bus``."""
        return self._bus.sibling(namespace)

    def claim(self) -> tuple[str, ...]:
        """See ``transport.Bus``."""
        return self._bus.claim()

    def metrics(self) -> dict[str, float]:
        """See ``transport.Bus``."""
        return self._bus.metrics()

    def close(self) -> None:
        """Leave the robot's network; the other bus is its owner's."""
        self._network.close()


class _FramePublisher:
    def __init__(self, network: RosNetwork) -> None:
        self._color, self._depth = network.write(COLOR, IMAGE), network.write(DEPTH, IMAGE)
        self._info = network.write(INFO, CAMERA_INFO)

    def put(self, message: RgbdFrame) -> None:
        self._info.put(robot_messages.camera_info_message(message))
        self._color.put(robot_messages.color_message(message))
        self._depth.put(robot_messages.depth_message(message))


class _OdometryPublisher:
    def __init__(self, network: RosNetwork) -> None:
        self._odometry, self._tf = network.write(ODOM, ODOMETRY), network.write("/tf", TF)

    def put(self, message: Odometry) -> None:
        self._tf.put(robot_messages.moving_transform(message))
        self._odometry.put(robot_messages.odometry_message(message))


class _CommandSubscription:
    """The newest TwistStamped as a command of nobody in particular: ROS 2 names no planner."""

    def __init__(self, network: RosNetwork, reader: Reader) -> None:
        self._network, self._reader = network, reader
        self._numbers = itertools.count(1)
        self._received = 0

    def take(self, timeout_s: float) -> VelocityCommand | None:
        deadline_s = time.monotonic() + timeout_s
        taken = self._reader.take()
        while not taken and (left_s := deadline_s - time.monotonic()) > 0:
            self._network.wait(left_s)
            taken = self._reader.take()
        if not taken:
            return None
        self._received += 1
        twist = decode(taken[-1], TWIST_STAMPED).twist
        speed = float(twist.linear.x), float(twist.angular.z)
        return VelocityCommand(next(self._numbers), time.time_ns(), *speed, BASE_TIMEOUT_MS)

    @property
    def counters(self) -> Counters:
        return Counters(received=self._received)
