"""From the robot's messages to frames and odometry: pairs, transforms, units."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from onemap_ros2.cdr import FormatError, decode, peek_stamp_ns, stamp_ns
from onemap_ros2.config import Ros2Config
from onemap_ros2.images import color_image, depth_image_mm, intrinsics
from onemap_ros2.pairing import PairBuffer
from onemap_ros2.transform_buffer import TransformBuffer, TransformError, TransformLate, rigid
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F64
from onemap_shared.messages import Odometry, RgbdFrame

IMAGE = "sensor_msgs/msg/Image"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
ODOMETRY = "nav_msgs/msg/Odometry"
TF = "tf2_msgs/msg/TFMessage"
JUMP_BACK_NS = 1_000_000_000  # further back than late messages come: the clock was set
MAX_WAITING = 50  # odometry messages; a quarter of a second at 200 Hz


@dataclass(slots=True)
class InputCounts:
    """What happened to the robot's messages since the start, for health."""

    frames: int = 0
    odometry: int = 0
    no_transform: int = 0
    unusable: int = 0
    clock_jumps: int = 0


@dataclass(frozen=True, slots=True)
class _Waiting:
    """Something that waits for its transform since ``since_s``; ``frame``: the one it is in."""

    stamp_ns: int
    frame: str
    since_s: float
    message: Any  # odometry, or the depth image
    color: bytes = b""


class RobotInput:
    """What the robot said, and what it makes. Times are monotonic seconds.

    ``problem``: what was wrong with the newest message that could not be used; empty again after
    one that could.
    """

    def __init__(self, config: Ros2Config) -> None:
        self._config = config
        self._transforms = TransformBuffer()
        self._pairs = PairBuffer(int(config.pair_tolerance_ms * 1e6))
        self._camera: Intrinsics | None = None
        self._odometry: deque[_Waiting] = deque(maxlen=MAX_WAITING)
        self._images: _Waiting | None = None
        self._newest_ns: int | None = None
        self._next_frame_ns = 0
        self.counts = InputCounts()
        self.problem = ""

    @property
    def has_camera(self) -> bool:
        """Whether camera information has come."""
        return self._camera is not None

    @property
    def unpaired(self) -> int:
        """Images that went without a counterpart."""
        return self._pairs.unpaired

    def add(self, kind: str, data: bytes, now_s: float) -> None:
        """A message of one of the topics, by the name of its setting. Unusable ones are counted."""
        try:
            self._add(kind, data, now_s)
        except ValueError as problem:
            self._refuse(problem)

    def take_odometry(self, now_s: float) -> Odometry | None:
        """The next odometry whose transform is there."""
        while self._odometry:
            waiting = self._odometry[0]
            try:
                T_map_odom = self._lookup(waiting, now_s)
                self._odometry.popleft()
                made = self._make_odometry(waiting, T_map_odom)
            except TransformLate:
                return None
            except TransformError as problem:
                self._odometry.popleft()
                self._miss(problem)
            except ValueError as problem:
                self._refuse(problem)
            else:
                self.counts.odometry += 1
                return made
        return None

    def take_frame(self, now_s: float) -> RgbdFrame | None:
        """The newest frame whose color, depth, camera and transform are there."""
        if self._camera is None:
            return None
        try:
            self._images = self._images or self._next_images(now_s)
            if self._images is None:
                return None
            T_map_camera = self._lookup(self._images, now_s)
            made = self._make_frame(self._images, self._camera, T_map_camera)
        except TransformLate:
            return None
        except TransformError as problem:
            self._miss(problem)
        except ValueError as problem:
            self._refuse(problem)
        else:
            self._images = None
            self.counts.frames += 1
            self.problem = ""
            return made
        self._images = None
        return None

    def _add(self, kind: str, data: bytes, now_s: float) -> None:
        if kind == "color":
            self._pairs.add_color(peek_stamp_ns(data), data)
        elif kind == "depth":
            self._pairs.add_depth(peek_stamp_ns(data), data)
        elif kind == "camera_info":
            self._camera = intrinsics(decode(data, CAMERA_INFO), rectified=self._config.rectified)
        elif kind == "odometry":
            self._add_odometry(decode(data, ODOMETRY), now_s)
        else:
            for stamped in decode(data, TF).transforms:
                self._add_transform(stamped, static=kind == "tf_static")

    def _add_transform(self, stamped: Any, *, static: bool) -> None:
        move, turn = stamped.transform.translation, stamped.transform.rotation
        T = rigid((move.x, move.y, move.z), (turn.x, turn.y, turn.z, turn.w))
        parent, child = _frame(stamped.header.frame_id), _frame(stamped.child_frame_id)
        if static:
            self._transforms.add_static(parent, child, T)
        else:
            self._transforms.add(parent, child, stamp_ns(stamped.header.stamp), T)

    def _add_odometry(self, message: Any, now_s: float) -> None:
        stamp = stamp_ns(message.header.stamp)
        if self._newest_ns is not None and stamp < self._newest_ns - JUMP_BACK_NS:
            self._start_over()
        self._newest_ns = max(self._newest_ns or stamp, stamp)
        frame = _frame(message.header.frame_id)
        self._odometry.append(_Waiting(stamp, frame, now_s, message))

    def _start_over(self) -> None:
        """The clock was set back: what came before belongs to another time."""
        self.counts.clock_jumps += 1
        self._transforms.forget_motion()
        self._pairs.clear()
        self._odometry.clear()
        self._images, self._newest_ns, self._next_frame_ns = None, None, 0

    def _next_images(self, now_s: float) -> _Waiting | None:
        pair = self._pairs.take()
        if pair is None or pair.stamp_ns < self._next_frame_ns:
            return None
        self._next_frame_ns = pair.stamp_ns + int(0.9e9 / self._config.frame_rate_hz)
        depth = decode(pair.depth, IMAGE)
        frame = _frame(depth.header.frame_id)
        return _Waiting(pair.stamp_ns, frame, now_s, depth, pair.color)

    def _lookup(self, waiting: _Waiting, now_s: float) -> F64:
        """T_map_frame of what waits; TransformLate as long as it may wait, then TransformError."""
        try:
            return self._transforms.lookup(self._config.map_frame, waiting.frame, waiting.stamp_ns)
        except TransformLate as problem:
            if now_s - waiting.since_s < self._config.transform_wait_ms * 1e-3:
                raise
            raise TransformError(str(problem)) from problem

    def _make_frame(self, images: _Waiting, camera: Intrinsics, T_map_camera: F64) -> RgbdFrame:
        rgb = color_image(decode(images.color, IMAGE))
        depth_mm = depth_image_mm(images.message)
        if rgb.shape[:2] != depth_mm.shape:
            raise FormatError(
                f"the depth image has {depth_mm.shape[1]} x {depth_mm.shape[0]} pixels and the "
                f"color image {rgb.shape[1]} x {rgb.shape[0]}: choose a depth topic that is "
                "registered to the color image"
            )
        return RgbdFrame(self.counts.frames, images.stamp_ns, rgb, depth_mm, camera, T_map_camera)

    def _make_odometry(self, waiting: _Waiting, T_map_odom: F64) -> Odometry:
        pose, twist = waiting.message.pose.pose, waiting.message.twist.twist
        place, turn = pose.position, pose.orientation
        T_odom_body = rigid((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))
        speed = (float(twist.linear.x), float(twist.angular.z))
        if not np.isfinite(speed).all():
            raise FormatError(f"the odometry's velocity {speed} is not finite")
        return Odometry(self.counts.odometry, waiting.stamp_ns, T_map_odom @ T_odom_body, *speed)

    def _miss(self, problem: TransformError) -> None:
        self.counts.no_transform += 1
        self.problem = str(problem)

    def _refuse(self, problem: ValueError) -> None:
        self.counts.unusable += 1
        self.problem = str(problem)


def _frame(name: str) -> str:
    """A frame's name without the slash that ROS 1 put before it."""
    return str(name).removeprefix("/")
