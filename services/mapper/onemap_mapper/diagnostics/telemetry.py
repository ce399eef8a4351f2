"""Counters, rates and the current problem of the mapper."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from onemap_mapper.diagnostics.depth_diagnostics import DepthDiagnostics
from onemap_mapper.diagnostics.floor_monitor import FloorMonitor, FloorState
from onemap_shared.rates import RateMeter
from onemap_shared.transport import Counters

SILENT_AFTER_S = 5.0  # without a frame for this long the map is not up to date


@dataclass(slots=True)
class MapperTelemetry:
    """What happened to the frames so far. Times are monotonic seconds. Not thread-safe."""

    rejected: int = 0
    late: int = 0
    rejection: str = ""  # why the newest frame was rejected, empty if it was fused
    update_ms: float = 0.0
    depth: DepthDiagnostics | None = None
    _floor: FloorMonitor = field(default_factory=FloorMonitor)
    _fused: RateMeter = field(default_factory=RateMeter)

    def record_fused(self, *, now_s: float, update_ms: float, depth: DepthDiagnostics) -> None:
        """Count a frame that went into the map."""
        self.rejection, self.update_ms, self.depth = "", update_ms, depth
        self._fused = self._fused.with_event(now_s)
        if depth.surface is not None:
            self._floor = self._floor.with_surface(depth.surface, depth.viewpoint, now_s)

    def record_rejected(self, reason: str) -> None:
        """Count a frame that did not."""
        self.rejected += 1
        self.rejection = reason

    def reset_floor(self) -> None:
        """Drop all readings of the floor: a new map may have another frame."""
        self._floor = FloorMonitor()

    def rate_hz(self, now_s: float) -> float:
        """Frames fused per second."""
        return self._fused.rate_hz(now_s)

    def ready(self, now_s: float) -> bool:
        """Whether frames reach the map."""
        return not self.rejection and self._silent_s(now_s) <= SILENT_AFTER_S

    def metrics(self, now_s: float, counters: Counters) -> dict[str, float]:
        """Numbers for the heartbeat; those of the depth once there was a frame."""
        numbers = {
            "update_ms": self.update_ms,
            "rate_hz": self.rate_hz(now_s),
            "frames_missed": float(counters.missed),
            "frames_refused": float(counters.refused + self.rejected),
            "frames_late": float(self.late),
        }
        if self.depth is not None:
            numbers["depth_valid_fraction"] = self.depth.valid_fraction
            numbers["near_fraction"] = self.depth.near_fraction
            numbers |= self._floor_metrics(now_s)
        return numbers

    def _floor_metrics(self, now_s: float) -> dict[str, float]:
        """How many viewpoints saw a level surface; height, tilt and ``floor_wrong`` only once
        there are enough of them to tell."""
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
        silent_s = self._silent_s(now_s)
        if math.isinf(silent_s):
            return "no frame has arrived yet: is perception running?"
        if silent_s > SILENT_AFTER_S:
            return f"no frame for {silent_s:.0f} s: is perception running?"
        depth_problem = self.depth.problem if self.depth else ""
        return depth_problem or self._floor.assessment(now_s).problem

    def _silent_s(self, now_s: float) -> float:
        return self._fused.silent_s(now_s, since_s=-math.inf)
