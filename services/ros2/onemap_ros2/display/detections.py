"""The found objects as ``vision_msgs/Detection3DArray``."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from onemap_ros2.cdr import encode, header, new
from onemap_ros2.ros_types import DETECTION_ARRAY
from onemap_shared.messages import KeptObject


def detection_array(objects: Iterable[KeptObject], stamp_ns: int, frame: str) -> bytes:
    """One detection per kept object, with its id, name and score.

    The box has the extent of the cells that the object was seen on, and its heights. Where the map
    does not know them, the box is flat, at the middle of the object.
    """
    head = header(stamp_ns, frame)
    found = [_detection(head, kept) for kept in objects]
    return encode(new(DETECTION_ARRAY, head, found), DETECTION_ARRAY)


def _detection(head: object, kept: KeptObject) -> object:
    x0, y0, x1, y1 = kept.extent_m
    x, y, z = kept.position_m
    low, high = kept.height_m or (z, z)
    hypothesis = new("vision_msgs/msg/ObjectHypothesis", kept.name, kept.score)
    seen = new("geometry_msgs/msg/PoseWithCovariance", _pose(x, y, z), np.zeros(36))
    result = new("vision_msgs/msg/ObjectHypothesisWithPose", hypothesis, seen)
    size = new("geometry_msgs/msg/Vector3", x1 - x0, y1 - y0, high - low)
    middle = _pose(0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (low + high))
    box = new("vision_msgs/msg/BoundingBox3D", middle, size)
    return new("vision_msgs/msg/Detection3D", head, [result], box, kept.object_id)


def _pose(x: float, y: float, z: float) -> object:
    upright = new("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0)
    return new("geometry_msgs/msg/Pose", new("geometry_msgs/msg/Point", x, y, z), upright)
