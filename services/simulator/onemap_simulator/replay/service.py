"""The replay service: publishes the frames of a recording like a robot.

Frames are stamped and numbered when they are published, so that checks of staleness
work as with a robot. Velocity commands are ignored.
"""

from __future__ import annotations

import logging

import numpy as np

from onemap_shared.geometry import F64, pose_2d
from onemap_shared.keys import RGBD_RECEIPTS, ROBOT_ODOMETRY, ROBOT_RGBD
from onemap_shared.messages import Odometry, RgbdFrame
from onemap_shared.runner import StartError
from onemap_shared.transport import Bus, Health
from onemap_simulator.replay.config import ReplayConfig
from onemap_simulator.replay.recording import Recording, RecordingError

LOG = logging.getLogger("onemap.replay")
RECEIPTS = 64  # between two frames there is one


class ReplayWorker:
    """Publishes one frame and its odometry each period."""

    def __init__(self, bus: Bus, recording: Recording, config: ReplayConfig) -> None:
        self._recording, self._clock = recording, bus.clock
        self._world = f"recording {recording.digest[:12]}"
        self._period_s = 1.0 / config.rate_hz
        self._frames = bus.publish(ROBOT_RGBD)
        self._odometry = bus.publish(ROBOT_ODOMETRY)
        self._sequence = 0
        self._receipts = bus.subscribe(RGBD_RECEIPTS, RECEIPTS)
        self._unreadable = 0
        self._published = self._taken = 0  # in this round; taken: by perception
        self._lost: int | None = None  # in the last round
        self._problem = ""
        self._due_s = self._clock.monotonic_s()

    def step(self, timeout_s: float) -> None:
        """Publish the next frame if it is due, else wait for it; begins again after the last."""
        wait_s = self._due_s - self._clock.monotonic_s()
        if wait_s > timeout_s:
            self._clock.sleep(timeout_s)
            return
        self._clock.sleep(max(wait_s, 0.0))
        # Frames missed in a stall are not published in a burst.
        self._due_s = max(self._due_s + self._period_s, self._clock.monotonic_s())
        while self._receipts.take(0.0) is not None:
            self._taken += 1
        index = self._sequence % len(self._recording)
        if index == 0 and self._sequence:
            self._end_round()
        self._publish(index)
        self._sequence += 1

    def _end_round(self) -> None:
        """Count the frames that perception did not take, being busy with others."""
        lost = self._lost = max(self._published - self._taken, 0)
        if lost:
            self._problem = (
                f"{lost} of {self._published} frames were lost, because perception was busy with "
                "others: lower replay.rate_hz"
            )
            LOG.warning("%s", self._problem)
        self._published = self._taken = 0

    def _publish(self, index: int) -> None:
        try:
            frame = self._recording.frame(index)
        except RecordingError as problem:
            self._unreadable += 1
            self._problem = str(problem)
            LOG.warning("frame %d is left out: %s", index, problem)
            return
        self._published += 1
        stamp_ns = self._clock.wall_ns()
        body = body_below(frame.T_map_camera)
        self._odometry.put(Odometry(self._sequence, stamp_ns, body, 0.0, 0.0))
        self._frames.put(
            RgbdFrame(
                self._sequence,
                stamp_ns,
                frame.rgb,
                frame.depth_mm,
                self._recording.intrinsics,
                frame.T_map_camera,
                self._world,
            )
        )

    def health(self) -> Health:
        """Ready while at least one frame could be read."""
        played = self._sequence - self._unreadable
        return Health(
            ready=played > 0,
            problem=self._problem,
            metrics={
                "frames_recorded": len(self._recording),
                "frames_played": played,
                "frames_unreadable": self._unreadable,
                **({} if self._lost is None else {"frames_lost": self._lost}),
            },
        )

    def close(self) -> None:
        """Nothing to close: every image is closed once read."""


def body_below(T_map_camera: F64) -> F64:
    """T_map_body (4, 4): on the floor below the camera, heading where it looks."""
    forward = T_map_camera[:2, 2]
    yaw = float(np.arctan2(forward[1], forward[0]))
    return pose_2d(float(T_map_camera[0, 3]), float(T_map_camera[1, 3]), yaw)


def build(bus: Bus, config: ReplayConfig) -> ReplayWorker:
    """Open the recording and make the worker, or raise StartError."""
    return ReplayWorker(bus, open_recording(config), config)


def check(config: ReplayConfig) -> None:
    """Raise StartError if the recording cannot be played; fast, and without the bus."""
    open_recording(config)


def open_recording(config: ReplayConfig) -> Recording:
    """The recording; StartError if its index or its first frame cannot be read."""
    try:
        recording = Recording.open(config.directory)
        recording.frame(0)  # fail at the start if no image can be read
    except RecordingError as problem:
        raise StartError(str(problem)) from problem
    return recording
