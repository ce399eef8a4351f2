"""A robot that publishes what was rendered, and encoded, beforehand, and notes how far it came."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from onemap_perception.encoders.protocol import ImageEncoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_shared import keys
from onemap_shared.geometry import F16, F32, F64, U8, U16, inverse
from onemap_shared.keys import Topic
from onemap_shared.messages import FeatureField, Heartbeat, Odometry, RgbdFrame
from onemap_shared.transport import Bus, Subscription
from onemap_simulator.config import ODOMETRY_HZ
from onemap_simulator.errors import DepthErrorParams
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, RgbdCamera
from onemap_simulator.scene.scene import Scene

DEPTH_NOISE_M = 0.002  # at 1 m, as a stereo camera's: without it depth compresses too well
VIEWS = 16  # of a turn
BUFFERED = 64  # messages between two looks of a thread
WAIT_S = 0.2
# What says that a frame has come so far, in order, by the process that then has it.
STAGES: Mapping[str, Topic[Any]] = {
    "perception": keys.RGBD_RECEIPTS,
    "mapper": keys.FIELD_RECEIPTS,
    (MAP := "planner"): keys.MAP_REVISION,
    (COMMAND := "command"): keys.ROBOT_CMD_VEL,
}
HEALTH = "health"


@dataclass(frozen=True)
class Stream:
    """N images and what perception made of them: rgb (N, H, W, 3), depth_mm (N, H, W), features
    (N, h, w, D), variance (N, H, W), T_map_camera (N, 4, 4)."""

    rgb: U8
    depth_mm: U16
    features: F16
    variance: F32
    T_map_camera: F64

    def frame(self, number: int, stamp_ns: int) -> RgbdFrame:
        """The frame of this sequence number."""
        which = number % len(self.rgb)
        camera = CameraParams(width=self.rgb.shape[2], height=self.rgb.shape[1]).intrinsics
        pose = self.T_map_camera[which]
        return RgbdFrame(number, stamp_ns, self.rgb[which], self.depth_mm[which], camera, pose)

    def field(self, frame: RgbdFrame, encoder_id: str, text_space: str) -> FeatureField:
        """The field of a frame of this stream."""
        which = frame.sequence % len(self.rgb)
        return FeatureField(
            frame.sequence,
            frame.stamp_ns,
            encoder_id,
            text_space,
            self.features[which],
            self.variance[which],
            frame.depth_mm,
            frame.intrinsics,
            frame.T_map_camera,
        )

    def part(self, robot: int) -> Stream:
        """The ``VIEWS`` images of one robot."""
        own = slice(robot * VIEWS, (robot + 1) * VIEWS)
        return Stream(**{name: values[own] for name, values in vars(self).items()})


def make_stream(
    encoder: ImageEncoder, scene: Scene, size_px: tuple[int, int], bodies: Sequence[F64]
) -> Stream:
    """Images (width, height) with noisy depth from poses T_map_body (4, 4), encoded."""
    params = CameraParams(width=size_px[0], height=size_px[1])
    errors, rng = DepthErrorParams(noise_m=DEPTH_NOISE_M), np.random.default_rng(0)
    camera = RgbdCamera(scene, Renderer(scene), params, rng, errors)
    frames, fields = [], []
    for number, body in enumerate(bodies):
        image, pose = camera.capture(body), body @ params.mount
        frame = RgbdFrame(number, 1, image.rgb, image.depth_mm, camera.intrinsics, pose)
        frames.append(frame)
        fields.append(feature_field(frame, encoder.encode(frame.rgb), encoder, VarianceParams()))
    return Stream(
        np.stack([frame.rgb for frame in frames]),
        np.stack([frame.depth_mm for frame in frames]),
        np.stack([field.features for field in fields]),
        np.stack([field.variance for field in fields]),
        np.stack([frame.T_map_camera for frame in frames]),
    )


class RecordedRobot:
    """Publishes a stream's frames; with an encoder, whose fields they are, the fields too.

    ages: by stage and capture time, when a frame was first there (monotonic, seconds) and how old
    it was (seconds). sent: when frames were published.
    """

    def __init__(self, bus: Bus, stream: Stream, encoder: ImageEncoder | None) -> None:
        self.bus, self.stream, self.encoder = bus, stream, encoder
        self.sent: list[float] = []
        self.ages: dict[str, dict[int, tuple[float, float]]] = {name: {} for name in STAGES}
        self.beats: list[tuple[float, Heartbeat]] = []
        self._body = stream.T_map_camera[0]
        if encoder is not None:
            bus.serve(keys.EMBED_TEXT, lambda request: encoder.embed_text(request.texts))

    @property
    def fused(self) -> list[float]:
        """When a frame of it was new in the map."""
        return [at for stamp_ns, (at, _) in self.ages[MAP].copy().items() if stamp_ns]

    def start(self, rate_hz: float, wait_s: float, stop: threading.Event) -> list[threading.Thread]:
        """Its threads; the first frame comes after ``wait_s``."""
        followed = {**STAGES, HEALTH: keys.ALL_HEARTBEATS}
        inboxes = {name: self.bus.subscribe(topic, BUFFERED) for name, topic in followed.items()}
        jobs = [partial(self._follow, name, inbox, stop) for name, inbox in inboxes.items()]
        jobs += [partial(self._publish, rate_hz, wait_s, stop), partial(self._move, rate_hz, stop)]
        threads = [threading.Thread(target=job, daemon=True) for job in jobs]
        for thread in threads:
            thread.start()
        return threads

    def _publish(self, rate_hz: float, wait_s: float, stop: threading.Event) -> None:
        frames, fields = self.bus.publish(keys.ROBOT_RGBD), self.bus.publish(keys.FIELD)
        mount = inverse(CameraParams().mount)
        due_s = time.monotonic() + wait_s
        while not stop.wait(max(due_s - time.monotonic(), 0.0)):
            frame = self.stream.frame(len(self.sent), time.time_ns())
            self._body = frame.T_map_camera @ mount
            frames.put(frame)
            if self.encoder is not None:
                names = self.encoder.encoder_id, self.encoder.text_space
                fields.put(self.stream.field(frame, *names))
            self.sent.append(time.monotonic())
            due_s = max(due_s + 1.0 / rate_hz, time.monotonic())

    def _move(self, rate_hz: float, stop: threading.Event) -> None:
        poses, number = self.bus.publish(keys.ROBOT_ODOMETRY), 0
        while not stop.wait(1.0 / ODOMETRY_HZ):
            turning_radps = 2 * math.pi / VIEWS * rate_hz
            poses.put(Odometry(number, time.time_ns(), self._body, 0.0, turning_radps))
            number += 1

    def _follow(self, name: str, inbox: Subscription[Any], stop: threading.Event) -> None:
        message: Any = None
        while message is not None or not stop.is_set():  # at the end, what has come by then
            message = inbox.take(0.0 if stop.is_set() else WAIT_S)
            now_s, now_ns = time.monotonic(), time.time_ns()
            if name == HEALTH and message is not None:
                self.beats.append((now_s, message))
            elif message is not None:
                stamp_ns = message.frame_ns if name == COMMAND else message.stamp_ns
                self.ages[name].setdefault(stamp_ns, (now_s, (now_ns - stamp_ns) * 1e-9))
