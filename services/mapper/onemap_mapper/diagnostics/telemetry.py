"""Counters and rates of the mapper, and the sentence that says what is wrong."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

from onemap_mapper.diagnostics.depth_diagnostics import DepthDiagnostics
from onemap_mapper.diagnostics.floor_monitor import FloorMonitor, FloorState
from onemap_shared.transport import Counters

RATE_WINDOW_S = 5.0
SILENT_AFTER_S = 5.0  # without a frame for this long the map is not being kept
NEAR_LIMIT = 0.5  # of the depth nearer than 0.1 m


@dataclass(slots=True)
class MapperTelemetry:
    """What happened to the frames so far. Times are monotonic seconds. Not thread-safe."""

    refused: int = 0
    late: int = 0
    rejection: str = ""  # why the newest frame was refused, empty if it was fused
    update_ms: float = 0.0
    depth: DepthDiagnostics | None = None
    _floor: FloorMonitor = field(default_factory=FloorMonitor)
    _fused_at_s: deque[float] = field(default_factory=deque)

    def fused(self, *, now_s: float, update_ms: float, depth: DepthDiagnostics) -> None:
        """Note a frame that went into the map."""
        self.rejection, self.update_ms, self.depth = "", update_ms, depth
        self._fused_at_s.append(now_s)
        if depth.surface is not None:
            self._floor = self._floor.with_surface(depth.surface, depth.viewpoint, now_s)
        while now_s - self._fused_at_s[0] > RATE_WINDOW_S:
            self._fused_at_s.popleft()

    def record_rejected(self, reason: str) -> None:
        """Note a frame that did not."""
        self.refused += 1
        self.rejection = reason

    def reset_floor(self) -> None:
        """Drop all readings of the floor: a new map may have another frame."""
        self._floor = FloorMonitor()

    def rate_hz(self, now_s: float) -> float:
        """Frames fused per second over the last five seconds."""
        recent = [at for at in self._fused_at_s if now_s - at <= RATE_WINDOW_S]
        if len(recent) < 2:
            return 0.0
        return (len(recent) - 1) / max(now_s - recent[0], 1e-3)

    def ready(self, now_s: float) -> bool:
        """Whether frames reach the map."""
        return not self.rejection and self._silent_s(now_s) <= SILENT_AFTER_S

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
            numbers |= self._floor_metrics(now_s)
        return numbers

    def _floor_metrics(self, now_s: float) -> dict[str, float]:
        """How many viewpoints tell of the floor; where it is and whether that is wrong only once
        they tell it."""
        assessment = self._floor.assessment(now_s)
        numbers = {"floor_viewpoints": float(assessment.viewpoints)}
        if assessment.state is not FloorState.UNKNOWN:
            numbers["floor_height_m"] = assessment.height_m
            numbers["floor_tilt_deg"] = math.degrees(assessment.tilt_rad)
            numbers["floor_wrong"] = float(assessment.state is FloorState.INCONSISTENT)
        return numbers

    def problem(self, now_s: float) -> str:
        """What is wrong, in one sentence; empty if nothing is."""
        if self.rejection:
            return self.rejection
        if not self._fused_at_s:
            return "no frame has arrived yet: is perception running?"
        if self._silent_s(now_s) > SILENT_AFTER_S:
            return f"no frame for {self._silent_s(now_s):.0f} s: is perception running?"
        wrong_depth = depth_problem(self.depth) if self.depth else ""
        return wrong_depth or self._floor.assessment(now_s).problem

    def _silent_s(self, now_s: float) -> float:
        return now_s - self._fused_at_s[-1] if self._fused_at_s else math.inf


def depth_problem(depth: DepthDiagnostics) -> str:
    """What a depth image says is wrong with the sensor."""
    if depth.valid_fraction == 0:
        return "the newest depth image is all zero: is the depth camera on and aligned?"
    if depth.near_fraction > NEAR_LIMIT:
        return (
            f"{depth.near_fraction:.0%} of the depth is nearer than 0.1 m: "
            "is it in millimetres, and the lens free?"
        )
    return ""
