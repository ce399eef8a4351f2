"""The robot of ``onemap demo --ros2``: the simulator on the formats of rmw_zenoh.

It joins OneMap's bus too, under a name that is no robot's: the demo asks it for the ground truth.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import astuple
from typing import Any, cast

import numpy as np
from scipy.spatial.transform import Rotation

from onemap_ros2.cdr import (
    CAMERA_INFO,
    IMAGE,
    ODOMETRY,
    TF,
    TWIST_STAMPED,
    decode,
    encode,
    header,
    new,
)
from onemap_ros2.network.interface import NetworkError, RosNetwork, Writer
from onemap_ros2.network.rmw import RmwNetwork
from onemap_shared.geometry import F64
from onemap_shared.keys import ROBOT_CMD_VEL, ROBOT_ODOMETRY, ROBOT_RGBD, Topic
from onemap_shared.messages import Odometry, RgbdFrame, VelocityCommand
from onemap_shared.runner import ServiceParts, StartError, run_service
from onemap_shared.transport import Bus, Counters, Publisher, Subscription
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.service import SimulatorWorker, check, open_scene
from onemap_tools.demo.setup import ROS2_ROBOT

ROUTER_VARIABLE = "ONEMAP_DEMO_ROUTER"  # where the robot's network is; the demo sets it
DOMAIN = 0
COLOR, DEPTH, INFO = "/camera/color/image_raw", "/camera/depth/image_raw", "/camera/camera_info"
MAP, BASE, CAMERA = "map", "base_link", "camera_optical_frame"


class Ros2RobotBus:
    """A ``transport.Bus``: frames, odometry and commands go over ROS 2, the rest as ever.

    T_body_camera: (4, 4), where the camera is mounted; published once, latched.
    """

    def __init__(self, bus: Bus, network: RosNetwork, T_body_camera: F64) -> None:
        self._bus, self._network = bus, network
        fixed = _transform(T_body_camera, BASE, CAMERA, 0)
        network.write("/tf_static", TF, latched=True).put(fixed)

    def __getattr__(self, name: str) -> Any:
        """All else is the other bus."""
        return getattr(self._bus, name)

    def publish(self, topic: Topic[Any]) -> Publisher[Any]:
        """See ``transport.Bus``."""
        write = self._network.write
        if topic == ROBOT_RGBD:
            return _Writers(
                (write(INFO, CAMERA_INFO), _camera_info),
                (write(COLOR, IMAGE), lambda frame: _image(frame, frame.rgb, "rgb8")),
                (write(DEPTH, IMAGE), lambda frame: _image(frame, frame.depth_mm, "16UC1")),
            )
        if topic == ROBOT_ODOMETRY:
            return _Writers(
                (write("/tf", TF), lambda o: _transform(o.T_map_body, MAP, BASE, o.stamp_ns)),
                (write("/odom", ODOMETRY), _odometry),
            )
        return self._bus.publish(topic)

    def subscribe(self, topic: Topic[Any], *options: Any) -> Subscription[Any]:
        """See ``transport.Bus``; a command of the robot's network sets no event."""
        if topic == ROBOT_CMD_VEL:
            return _Commands(self._network)
        return self._bus.subscribe(topic, *options)

    def close(self) -> None:
        """Leave the robot's network; the other bus is its owner's."""
        self._network.close()


class _Writers:
    """Writes a message to several topics of ROS 2, each in a form of its own."""

    def __init__(self, *topics: tuple[Writer, Callable[[Any], bytes]]) -> None:
        self._topics = topics

    def put(self, message: Any) -> None:
        for writer, form in self._topics:
            writer.put(form(message))


class _Commands:
    """The newest TwistStamped as a command of nobody in particular: ROS 2 names no planner."""

    def __init__(self, network: RosNetwork) -> None:
        self._network, self._reader = network, network.read("/cmd_vel", TWIST_STAMPED, 1)
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
        return VelocityCommand(self._received, time.time_ns(), *speed)

    @property
    def counters(self) -> Counters:
        return Counters(received=self._received)


def _image(frame: RgbdFrame, pixels: np.ndarray, encoding: str) -> bytes:
    """An image (H, W, ...) of a little-endian type."""
    height, width = pixels.shape[:2]
    data = np.ascontiguousarray(pixels).view(np.uint8).reshape(-1)
    head, step = header(frame.stamp_ns, CAMERA), len(data) // height
    return encode(new(IMAGE, head, height, width, encoding, 0, step, data), IMAGE)


def _camera_info(frame: RgbdFrame) -> bytes:
    """The camera; ROS has pixel centres at whole numbers, half a pixel before ours."""
    height, width = frame.depth_mm.shape
    fx, fy, cx, cy = astuple(frame.intrinsics)
    cx, cy = cx - 0.5, cy - 0.5
    K = np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1])
    P = np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0])
    whole = new("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, False)
    head, R = header(frame.stamp_ns, CAMERA), np.eye(3).ravel()
    fields = (head, height, width, "plumb_bob", np.zeros(5), K, R, P, 0, 0, whole)
    return encode(new(CAMERA_INFO, *fields), CAMERA_INFO)


def _odometry(odometry: Odometry) -> bytes:
    """The body's pose in the map frame, with its speed."""
    linear = _geometry("Vector3", odometry.linear_mps, 0.0, 0.0)
    angular = _geometry("Vector3", 0.0, 0.0, odometry.angular_radps)
    pose = _geometry("Pose", *_parts(odometry.T_map_body, "Point"))
    unknown = np.zeros(36)
    pose = _geometry("PoseWithCovariance", pose, unknown)
    twist = _geometry("TwistWithCovariance", _geometry("Twist", linear, angular), unknown)
    return encode(new(ODOMETRY, header(odometry.stamp_ns, MAP), BASE, pose, twist), ODOMETRY)


def _transform(T_parent_child: F64, parent: str, child: str, stamp_ns: int) -> bytes:
    turned = _geometry("Transform", *_parts(T_parent_child, "Vector3"))
    stamped = _geometry("TransformStamped", header(stamp_ns, parent), child, turned)
    return encode(new(TF, [stamped]), TF)


def _parts(T: F64, place: str) -> tuple[Any, Any]:
    """Where a pose is, as this type, and its quaternion."""
    turn = Rotation.from_matrix(T[:3, :3]).as_quat()
    return _geometry(place, *T[:3, 3].tolist()), _geometry("Quaternion", *turn.tolist())


def _geometry(name: str, *fields: Any) -> Any:
    return new(f"geometry_msgs/msg/{name}", *fields)


class Ros2Robot(SimulatorWorker):
    """The simulator's worker on a network of ROS 2, which it leaves at its end."""

    def __init__(self, bus: Bus, network: RosNetwork, config: SimulatorConfig) -> None:
        self._network = network
        joined = Ros2RobotBus(bus, network, config.camera.mount)
        super().__init__(cast(Bus, joined), open_scene(config), config)

    def close(self) -> None:
        """Stop the camera, then leave the robot's network."""
        super().close()
        self._network.close()


def build(bus: Bus, config: SimulatorConfig) -> Ros2Robot:
    """Join the robot's network and open the scene, or raise StartError."""
    try:
        network = RmwNetwork((os.environ[ROUTER_VARIABLE],), DOMAIN, ROS2_ROBOT)
        return Ros2Robot(bus, network, config)
    except NetworkError as problem:
        raise StartError(str(problem), temporary=True) from problem
    except ValueError as problem:
        raise StartError(str(problem)) from problem


def ros2_section(endpoint: str) -> dict[str, object]:
    """The adapter's section for this robot."""
    return {
        "connect": [endpoint],
        "domain": DOMAIN,
        "map_frame": MAP,
        "topics": {"color": COLOR, "depth": DEPTH, "camera_info": INFO},
    }


if __name__ == "__main__":
    parts = ServiceParts(SimulatorConfig, build, check, section="simulator")
    run_service(ROS2_ROBOT, lambda _: parts)
