"""What a simulated robot says, as the messages of a ROS 2 robot."""

from __future__ import annotations

from dataclasses import astuple
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from onemap_ros2.cdr import CAMERA_INFO, IMAGE, ODOMETRY, TF, encode, header, new
from onemap_shared.geometry import F64
from onemap_shared.messages import Odometry, RgbdFrame

MAP, BASE, CAMERA = "map", "base_link", "camera_optical_frame"
NO_COVARIANCE = np.zeros(36)


def color_message(frame: RgbdFrame) -> bytes:
    """The color image as rgb8."""
    return _image(frame, frame.rgb, "rgb8")


def depth_message(frame: RgbdFrame) -> bytes:
    """The depth image as 16UC1, millimetres."""
    return _image(frame, frame.depth_mm.astype("<u2", copy=False), "16UC1")


def camera_info_message(frame: RgbdFrame) -> bytes:
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


def odometry_message(odometry: Odometry) -> bytes:
    """The body's pose in the map frame, with its speed."""
    vector = "geometry_msgs/msg/Vector3"
    speed = new(
        "geometry_msgs/msg/Twist",
        new(vector, odometry.linear_mps, 0.0, 0.0),
        new(vector, 0.0, 0.0, odometry.angular_radps),
    )
    x, y, z = (float(value) for value in odometry.T_map_body[:3, 3])
    pose = new(
        "geometry_msgs/msg/Pose",
        new("geometry_msgs/msg/Point", x, y, z),
        _quaternion(odometry.T_map_body),
    )
    pose = new("geometry_msgs/msg/PoseWithCovariance", pose, NO_COVARIANCE)
    speed = new("geometry_msgs/msg/TwistWithCovariance", speed, NO_COVARIANCE)
    return encode(new(ODOMETRY, header(odometry.stamp_ns, MAP), BASE, pose, speed), ODOMETRY)


def moving_transform(odometry: Odometry) -> bytes:
    """map to base_link, as a robot's localisation publishes it."""
    return _transform(odometry.T_map_body, MAP, BASE, odometry.stamp_ns)


def fixed_transform(T_body_camera: F64) -> bytes:
    """base_link to the camera's optical frame."""
    return _transform(T_body_camera, BASE, CAMERA, 0)


def _transform(T_parent_child: F64, parent: str, child: str, stamp_ns: int) -> bytes:
    x, y, z = (float(value) for value in T_parent_child[:3, 3])
    moved = new("geometry_msgs/msg/Vector3", x, y, z)
    turned = new("geometry_msgs/msg/Transform", moved, _quaternion(T_parent_child))
    kind = "geometry_msgs/msg/TransformStamped"
    return encode(new(TF, [new(kind, header(stamp_ns, parent), child, turned)]), TF)


def _quaternion(T: F64) -> Any:
    turn = Rotation.from_matrix(T[:3, :3]).as_quat()
    return new("geometry_msgs/msg/Quaternion", *(float(value) for value in turn))


def _image(frame: RgbdFrame, pixels: np.ndarray, encoding: str) -> bytes:
    height, width = pixels.shape[:2]
    data = np.ascontiguousarray(pixels).view(np.uint8).reshape(-1)
    head, step = header(frame.stamp_ns, CAMERA), len(data) // height
    return encode(new(IMAGE, head, height, width, encoding, 0, step, data), IMAGE)
