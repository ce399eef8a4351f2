"""Messages of a ROS 2 robot for tests, encoded."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onemap_ros2.cdr import encode, header, new, time_of

WIDTH, HEIGHT = 8, 6
FX = 4.0


def vector(x: float, y: float, z: float, kind: str = "Vector3") -> object:
    return new(f"geometry_msgs/msg/{kind}", x, y, z)


def quaternion(yaw_rad: float) -> object:
    half = 0.5 * yaw_rad
    return new("geometry_msgs/msg/Quaternion", 0.0, 0.0, float(np.sin(half)), float(np.cos(half)))


def image(stamp_ns: int, pixels: NDArray, encoding: str, frame: str = "camera") -> bytes:
    height, width = pixels.shape[:2]
    data = np.frombuffer(np.ascontiguousarray(pixels).tobytes(), np.uint8)
    step = len(data) // height
    kind = "sensor_msgs/msg/Image"
    return encode(new(kind, header(stamp_ns, frame), height, width, encoding, 0, step, data), kind)


def camera_info(
    stamp_ns: int,
    width: int = WIDTH,
    height: int = HEIGHT,
    fx: float = FX,
    *,
    roi: tuple[int, int, int, int] = (0, 0, 0, 0),
) -> bytes:
    """roi: left, top, width and height."""
    kind = "sensor_msgs/msg/CameraInfo"
    cx, cy = width / 2 - 0.5, height / 2 - 0.5
    K = np.array([fx, 0, cx, 0, fx, cy, 0, 0, 1.0])
    P = np.array([2 * fx, 0, cx, 0, 0, 2 * fx, cy, 0, 0, 0, 1.0, 0])
    left, top, across, down = roi
    part = new("sensor_msgs/msg/RegionOfInterest", left, top, down, across, False)
    R, D = np.eye(3).ravel(), np.zeros(5)
    head = header(stamp_ns, "camera")
    info = new(kind, head, height, width, "plumb_bob", D, K, R, P, 0, 0, part)
    return encode(info, kind)


def odometry(
    stamp_ns: int,
    x_m: float = 0.0,
    yaw_rad: float = 0.0,
    linear_mps: float = 0.0,
    lateral_mps: float = 0.0,
) -> bytes:
    kind = "nav_msgs/msg/Odometry"
    pose = new("geometry_msgs/msg/Pose", vector(x_m, 0.0, 0.0, "Point"), quaternion(yaw_rad))
    speed = new(
        "geometry_msgs/msg/Twist", vector(linear_mps, lateral_mps, 0.0), vector(0.0, 0.0, 0.0)
    )
    zeros = np.zeros(36)
    pose = new("geometry_msgs/msg/PoseWithCovariance", pose, zeros)
    speed = new("geometry_msgs/msg/TwistWithCovariance", speed, zeros)
    return encode(new(kind, header(stamp_ns, "odom"), "base_link", pose, speed), kind)


def transforms(stamp_ns: int, *edges: tuple[str, str, float, float]) -> bytes:
    """A TFMessage of edges (parent, child, x in metres, yaw in radians)."""
    kind = "tf2_msgs/msg/TFMessage"
    stamped = [
        new(
            "geometry_msgs/msg/TransformStamped",
            header(stamp_ns, parent),
            child,
            new("geometry_msgs/msg/Transform", vector(x_m, 0.0, 0.0), quaternion(yaw_rad)),
        )
        for parent, child, x_m, yaw_rad in edges
    ]
    return encode(new(kind, stamped), kind)


def compressed(stamp_ns: int, data: bytes, form: str, frame: str = "camera") -> bytes:
    kind = "sensor_msgs/msg/CompressedImage"
    payload = np.frombuffer(data, np.uint8)
    return encode(new(kind, header(stamp_ns, frame), form, payload), kind)


def simulated_clock(now_ns: int) -> bytes:
    kind = "rosgraph_msgs/msg/Clock"
    return encode(new(kind, time_of(now_ns)), kind)
