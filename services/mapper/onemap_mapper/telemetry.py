"""Counters and rates of the mapper, and the sentence that says what is wrong."""

from __future__ import annotations

import math
import statistics
from collections import deque
from dataclasses import dataclass, field

from onemap_mapper.depth_check import DepthCheck
from onemap_shared.transport import Counters

RATE_WINDOW_S = 5.0
SILENT_AFTER_S = 5.0  # without a frame for this long the map is not being kept
FLOOR_LIMIT_M = 0.05
FLOOR_FRAMES = 25  # the floor of one frame follows every wobble of the pose; their median does not
NEAR_LIMIT = 0.5  # of the depth nearer than 0.1 m


@dataclass(slots=True)
class Telemetry:
    """What happened to the frames so far. Times are monotonic seconds. Not thread-safe."""

    refused: int = 0
    late: int = 0
    refusal: str = ""  # why the newest frame was refused, empty if it was fused
    update_ms: float = 0.0
    depth: DepthCheck | None = None
    _floors_m: deque[float] = field(default_factory=lambda: deque(maxlen=FLOOR_FRAMES))
    _fused_at_s: deque[float] = field(default_factory=deque)

    def fused(self, *, now_s: float, update_ms: float, depth: DepthCheck) -> None:
        """Note a frame that went into the map."""
        self.refusal, self.update_ms, self.depth = "", update_ms, depth
        self._fused_at_s.append(now_s)
        if math.isfinite(depth.floor_height_m):
            self._floors_m.append(depth.floor_height_m)
        while now_s - self._fused_at_s[0] > RATE_WINDOW_S:
            self._fused_at_s.popleft()

    def refuse(self, reason: str) -> None:
        """Note a frame that did not."""
        self.refused += 1
        self.refusal = reason

    def rate_hz(self, now_s: float) -> float:
        """Frames fused per second over the last five seconds."""
        recent = [at for at in self._fused_at_s if now_s - at <= RATE_WINDOW_S]
        if len(recent) < 2:
            return 0.0
        return (len(recent) - 1) / max(now_s - recent[0], 1e-3)

    def working(self, now_s: float) -> bool:
        """Whether frames reach the map."""
        return not self.refusal and self._silent_s(now_s) <= SILENT_AFTER_S

    def metrics(self, now_s: float, counters: Counters) -> dict[str, float]:
        """Numbers for the heartbeat; those of the depth once there was a frame."""
        numbers = {
            "update_ms": self.update_ms,
            "rate_hz": self.rate_hz(now_s),
            "frames_missed": float(counters.missed),
            "frames_refused": float(counters.refused + self.refused),
            "frames_late": float(self.late),
        }
        if self.depth is not None:
            numbers["depth_valid_fraction"] = self.depth.valid_fraction
            numbers["near_fraction"] = self.depth.near_fraction
        if self._floors_m:
            numbers["floor_height_m"] = statistics.median(self._floors_m)
        return numbers

    def problem(self, now_s: float) -> str:
        """What is wrong, in one sentence; empty if nothing is."""
        if self.refusal:
            return self.refusal
        if not self._fused_at_s:
            return "no frame has arrived yet: is perception running?"
        if self._silent_s(now_s) > SILENT_AFTER_S:
            return f"no frame for {self._silent_s(now_s):.0f} s: is perception running?"
        floor_m = statistics.median(self._floors_m) if self._floors_m else 0.0
        return depth_problem(self.depth, floor_m) if self.depth else ""

    def _silent_s(self, now_s: float) -> float:
        return now_s - self._fused_at_s[-1] if self._fused_at_s else math.inf


def depth_problem(depth: DepthCheck, floor_m: float) -> str:
    """What a depth image, and the floor of many, say is wrong with the sensor or its mounting."""
    if depth.valid_fraction == 0:
        return "the newest depth image is all zero: is the depth camera on and aligned?"
    if depth.near_fraction > NEAR_LIMIT:
        return (
            f"{depth.near_fraction:.0%} of the depth is nearer than 0.1 m: "
            "is it in millimetres, and the lens free?"
        )
    if abs(floor_m) > FLOOR_LIMIT_M:
        return (
            f"the floor appears at z = {floor_m:+.2f} m instead of 0: "
            "check the camera's mounting (T_map_camera)"
        )
    return ""
