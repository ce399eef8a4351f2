"""From the robot's messages to frames and odometry: pairs, transforms, units."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from onemap_ros2.cdr import (
    CAMERA_INFO,
    CLOCK,
    ODOMETRY,
    TF,
    FormatError,
    decode,
    image_type,
    peek_stamp_ns,
    stamp_ns,
)
from onemap_ros2.config import Ros2Config
from onemap_ros2.frame_images import FrameImages, naming
from onemap_ros2.images import CalibratedCamera, calibrated_camera
from onemap_ros2.transform_buffer import TransformBuffer, TransformError, TransformLate, rigid
from onemap_shared.geometry import F64
from onemap_shared.messages import Odometry, RgbdFrame

JUMP_BACK_NS = 500_000_000  # further back than late messages of a topic come: the clock was set
PAIR_TOLERANCE_NS = 15_000_000  # half a period at 30 Hz, so that neighbours are not mixed
FRAME_RATE_HZ = 15.0  # passed on: perception uses no more, and 30 Hz would fill a link
FRAME_PERIOD_NS = int(0.9e9 / FRAME_RATE_HZ)  # a tenth less: stamps jitter
STUCK_S = 1.0  # of images whose stamps hardly advance: more than a simulation lags behind
TRANSFORM_WAIT_S = 0.2  # of an image or odometry for its transform; localisation may be at 10 Hz
MAX_WAITING = 50  # odometry messages; a quarter of a second at 200 Hz
WAITS = object()
KEPT = 10  # of each kind: a third of a second at 30 Hz, more than two streams of a camera differ


class ImagePair(NamedTuple):
    """One color and one depth message, still encoded; the stamp is the depth's, in ns."""

    stamp_ns: int
    color: bytes
    depth: bytes


class PairBuffer:
    """Color and depth messages that wait for their counterpart, by stamp in ns.

    They are kept in the order of their arrival: stamps may jump.

    tolerance_ns: by how much the stamps of a pair may differ. unpaired: messages that went
    without a counterpart.
    """

    def __init__(self, tolerance_ns: int) -> None:
        self.tolerance_ns = tolerance_ns
        self.unpaired = 0
        self._waiting: dict[str, dict[int, bytes]] = {"color": {}, "depth": {}}

    def add(self, kind: str, stamp_ns: int, data: bytes) -> None:
        """A message, ``color`` or ``depth``."""
        waiting = self._waiting[kind]
        waiting.pop(stamp_ns, None)
        waiting[stamp_ns] = data
        if len(waiting) > KEPT:
            del waiting[next(iter(waiting))]
            self.unpaired += 1

    def take(self) -> ImagePair | None:
        """The pair whose depth came last, or None; what came before it is dropped."""
        colors, depths = self._waiting.values()
        for depth_ns in reversed(depths):
            color_ns = min(colors, key=lambda other: abs(other - depth_ns), default=None)
            if color_ns is not None and abs(color_ns - depth_ns) <= self.tolerance_ns:
                color = self._take("color", color_ns)
                return ImagePair(depth_ns, color, self._take("depth", depth_ns))
        return None

    def _take(self, kind: str, stamp_ns: int) -> bytes:
        waiting = self._waiting[kind]
        while (first_ns := next(iter(waiting))) != stamp_ns:
            del waiting[first_ns]
            self.unpaired += 1
        return waiting.pop(stamp_ns)

    def clear(self) -> None:
        """Forget everything: the clock jumped back."""
        for waiting in self._waiting.values():
            waiting.clear()


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
    color: Any = None  # the color image


class RobotInput:
    """What the robot said, and what it makes. Times are monotonic seconds.

    ``problem``: what was wrong with the newest message that could not be used; empty again after
    one that could.
    """

    def __init__(self, config: Ros2Config) -> None:
        self._config = config
        self._transforms = TransformBuffer()
        self._pairs = PairBuffer(PAIR_TOLERANCE_NS)
        self._camera: CalibratedCamera | None = None
        self._image_types = image_type(config.topics.color), image_type(config.topics.depth)
        self._odometry: deque[_Waiting] = deque(maxlen=MAX_WAITING)
        self._images: _Waiting | None = None
        self._newest_ns: dict[str, int] = {}  # stamps, by setting of the topic
        self._frame_ns: int | None = None  # stamp of the newest frame
        self._frame_s = 0.0  # when its images were there
        self.counts = InputCounts()
        self.problem = ""
        self.body_frame = "base_link"  # as the odometry names it
        self.clock_ns: int | None = None  # simulated time; None before the first

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
            made = self._made(self._odometry[0], self._make_odometry, now_s)
            if made is WAITS:
                return None
            self._odometry.popleft()
            if isinstance(made, Odometry):
                self.counts.odometry += 1
                return made
        return None

    def take_images(self, now_s: float) -> FrameImages | None:
        """The newest color and depth image whose camera and transform are there."""
        if not self.has_camera:
            return None
        try:
            self._images = self._images or self._next_images(now_s)
        except ValueError as problem:
            self._refuse(problem)
        if self._images is None:
            return None
        made = self._made(self._images, self._place_images, now_s)
        if made is WAITS:
            return None
        self._images = None
        return made if isinstance(made, FrameImages) else None

    def numbered(self, made: RgbdFrame | ValueError) -> RgbdFrame | None:
        """The frame that was made of images, counted; None for images of which none can be made."""
        if isinstance(made, ValueError):
            self._refuse(made)
            return None
        number = self.counts.frames
        self.counts.frames += 1
        self.problem = ""
        return replace(made, sequence=number)

    def take_frame(self, now_s: float) -> RgbdFrame | None:
        """The newest frame, for who has the time to wait until it is made."""
        images = self.take_images(now_s)
        if images is None:
            return None
        try:
            return self.numbered(images.frame())
        except ValueError as problem:
            return self.numbered(problem)

    def _made(self, waiting: _Waiting, make: Callable[..., object], now_s: float) -> object:
        """What becomes of it; WAITS if its transform may still come, None if it is of no use."""
        try:
            return make(waiting, self._lookup(waiting, now_s))
        except TransformLate:
            return WAITS
        except TransformError as problem:
            self.counts.no_transform += 1
            self.problem = str(problem)
        except ValueError as problem:
            self._refuse(problem)
        return None

    def _add(self, kind: str, data: bytes, now_s: float) -> None:
        if kind in ("color", "depth"):
            stamp = peek_stamp_ns(data)
            self._follow(kind, stamp)
            self._pairs.add(kind, stamp, data)
        elif kind == "camera_info":
            info = decode(data, CAMERA_INFO)
            with naming(self._config):
                self._camera = calibrated_camera(info, rectified=self._config.rectified)
        elif kind == "clock":
            self.clock_ns = stamp_ns(decode(data, CLOCK).clock)
            self._follow(kind, self.clock_ns)
        elif kind == "odometry":
            self._add_odometry(decode(data, ODOMETRY), now_s)
        else:
            for stamped in decode(data, TF).transforms:
                self._add_transform(stamped, kind, now_s)

    def _add_transform(self, stamped: Any, kind: str, now_s: float) -> None:
        """One transform of a message; one that cannot be used leaves the others as they are."""
        parent, child = _frame(stamped.header.frame_id), _frame(stamped.child_frame_id)
        move, turn = stamped.transform.translation, stamped.transform.rotation
        try:
            if parent == child:
                raise FormatError("places a frame in itself")
            T = rigid((move.x, move.y, move.z), (turn.x, turn.y, turn.z, turn.w))
        except ValueError as problem:
            topic = getattr(self._config.names, kind)
            reason = f"the transform of {child!r} in {parent!r} on {topic} {problem}"
            self._transforms.refuse(child, reason)
            self._refuse(FormatError(reason))
            return
        if kind == "tf_static":
            self._transforms.add_static(parent, child, T)
        else:
            self._transforms.add(parent, child, stamp_ns(stamped.header.stamp), T, now_s)

    def _add_odometry(self, message: Any, now_s: float) -> None:
        stamp = stamp_ns(message.header.stamp)
        self._follow("odometry", stamp)
        frame = _frame(message.header.frame_id)
        self._odometry.append(_Waiting(stamp, frame, now_s, message))

    def _follow(self, kind: str, stamp: int) -> None:
        """Start over where the stamps of a topic jump back: a clock was set, or one was wrong."""
        back_ns = self._newest_ns.get(kind, stamp) - stamp
        if back_ns > JUMP_BACK_NS:
            self._start_over()
            self.problem = (
                f"the stamps on {getattr(self._config.names, kind)} jumped back by "
                f"{back_ns * 1e-9:.1f} s: what came before is forgotten"
            )
        self._newest_ns[kind] = max(self._newest_ns.get(kind, stamp), stamp)

    def _start_over(self) -> None:
        """What came before belongs to another time."""
        self.counts.clock_jumps += 1
        self._transforms.forget_motion()
        self._pairs.clear()
        self._odometry.clear()
        self._newest_ns.clear()
        self._images, self._frame_ns = None, None

    def _next_images(self, now_s: float) -> _Waiting | None:
        pair = self._pairs.take()
        if pair is None:
            return None
        if self._frame_ns is not None and pair.stamp_ns < self._frame_ns + FRAME_PERIOD_NS:
            if now_s - self._frame_s > STUCK_S:
                self.problem = (
                    f"the stamps on {self._config.names.depth} hardly advance: by "
                    f"{(pair.stamp_ns - self._frame_ns) * 1e-9:.3f} s in "
                    f"{now_s - self._frame_s:.1f} s"
                )
            return None
        self._frame_ns, self._frame_s = pair.stamp_ns, now_s
        color_type, depth_type = self._image_types
        color, depth = decode(pair.color, color_type), decode(pair.depth, depth_type)
        frame = _frame(depth.header.frame_id)
        return _Waiting(pair.stamp_ns, frame, now_s, depth, color)

    def _lookup(self, waiting: _Waiting, now_s: float) -> F64:
        """T_map_frame of what waits; TransformLate while it may wait, then TransformError."""
        target = self._config.map_frame
        try:
            return self._transforms.lookup(target, waiting.frame, waiting.stamp_ns)
        except TransformLate as problem:
            if now_s - waiting.since_s < TRANSFORM_WAIT_S:
                raise
            raise TransformError(str(problem)) from problem

    def _place_images(self, images: _Waiting, T_map_camera: F64) -> FrameImages | None:
        if self._camera is None:
            return None
        stamp, color, depth = images.stamp_ns, images.color, images.message
        return FrameImages(stamp, color, depth, T_map_camera, self._camera, self._config)

    def _make_odometry(self, waiting: _Waiting, T_map_odom: F64) -> Odometry:
        pose, twist = waiting.message.pose.pose, waiting.message.twist.twist
        place, turn = pose.position, pose.orientation
        try:
            T_odom_body = rigid((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))
        except ValueError as problem:
            raise FormatError(f"the odometry's pose {problem}") from problem
        speed = tuple(map(float, (twist.linear.x, twist.angular.z, twist.linear.y)))
        if not np.isfinite(speed).all():
            raise FormatError(f"the odometry's velocity {speed} is not finite")
        linear_mps, angular_radps, lateral_mps = speed
        self.body_frame = _frame(waiting.message.child_frame_id) or self.body_frame
        return Odometry(
            self.counts.odometry,
            waiting.stamp_ns,
            T_map_odom @ T_odom_body,
            linear_mps,
            angular_radps,
            lateral_mps=lateral_mps,
        )

    def _refuse(self, problem: ValueError) -> None:
        self.counts.unusable += 1
        self.problem = str(problem)


def _frame(name: str) -> str:
    """A frame's name without the slash that ROS 1 put before it."""
    return str(name).removeprefix("/")
