"""What must hold in a run, whatever happens; judged by the truth that only the simulator knows.

Times are those of the virtual world, which no service can read. Limits are those that
``docs/reliability.md`` states, with 0.1 s for looking every ``PERIOD_S``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot
from typing import Any

from onemap_planner.service import Planner
from onemap_shared import keys
from onemap_shared.messages import MapRevision, RgbdFrame
from onemap_shared.wire import Packet, WireError, decode
from onemap_simulator.service import SimulatorWorker
from onemap_tools.virtual.system import VirtualSystem

PERIOD_S = 0.05
MOVES_MPS, TURNS_RADPS = 0.02, 0.05
STANDS_AFTER_S = 1.1 + 0.1  # its request, its planner or its link ended
# Twice the longest age of a map ("the world of too long ago"), and until it stands.
MAX_DATA_AGE_S = 2 * 1.5 + STANDS_AFTER_S
ZONE_SLACK_M = 0.03
MAX_REST_S = 100.0  # from the last incident to the end of every search: object limits, patience


@dataclass(frozen=True, slots=True)
class Violation:
    """A rule that did not hold: which, when, and how."""

    rule: str
    at_s: float
    what: str


@dataclass(slots=True)
class Zone:
    """A keep-out zone that was acknowledged: x0, y0, x1, y1 in metres of the truth."""

    name: str
    bounds_m: tuple[float, float, float, float]
    holds: bool = False  # the robot was outside since

    def distance_m(self, x_m: float, y_m: float) -> float:
        """From a point to the zone, 0 inside."""
        x0, y0, x1, y1 = self.bounds_m
        return hypot(max(x0 - x_m, x_m - x1, 0.0), max(y0 - y_m, y_m - y1, 0.0))


@dataclass(slots=True)
class Rules:
    """Looks at the robot every ``PERIOD_S``; ``broken``: the first violation of each rule."""

    system: VirtualSystem
    radius_m: float
    broken: list[Violation] = field(default_factory=list)
    zones: list[Zone] = field(default_factory=list)
    metres: float = 0.0  # driven
    _live_s: float = float("-inf")  # when a request was last alive
    _captured_s: dict[int, float] = field(default_factory=dict)  # of frames, by their stamp
    _fused_s: float = float("-inf")  # capture of the newest frame in the announced map

    def begin(self) -> None:
        """Look from now on."""
        self.system.router.observers.append(self._see)
        self.system.world.at(PERIOD_S, self._look)

    def tell(self, rule: str, what: str) -> None:
        """A rule is broken."""
        if all(each.rule != rule for each in self.broken):
            self.broken.append(Violation(rule, round(self.system.world.now_s, 2), what))

    def _see(self, key: str, packet: Packet) -> None:
        now_s = self.system.world.now_s
        try:
            frame = decode(RgbdFrame, packet) if key == keys.ROBOT_RGBD.key else None
            revision = decode(MapRevision, packet) if key == keys.MAP_REVISION.key else None
        except WireError:  # damaged
            return
        if frame is not None:
            self._captured_s.setdefault(frame.stamp_ns, now_s)
        if revision is not None:
            stamp_ns = revision.stamp_ns
            self._fused_s = max(self._captured_s.get(stamp_ns, float("-inf")), self._fused_s)

    def _look(self) -> None:
        self.system.world.at(PERIOD_S, self._look)
        now_s = self.system.world.now_s
        if self._request_lives():
            self._live_s = now_s
        simulator = self.system.services["simulator"]
        if not simulator.process.alive or not isinstance(simulator.worker, SimulatorWorker):
            self.zones.clear()  # another driver: they are set aside with the map
            return
        state: Any = simulator.worker._simulation.state
        velocity = state.velocity
        speed_mps = hypot(velocity.linear_mps, velocity.lateral_mps)
        self.metres += speed_mps * PERIOD_S
        if not simulator.process.stalled:
            self._judge(now_s, speed_mps, abs(velocity.angular_radps))
        x_m, y_m = state.pose[:2, 3].tolist()
        for zone in self.zones:
            distance_m = zone.distance_m(x_m, y_m)
            if zone.holds and distance_m < self.radius_m - ZONE_SLACK_M:
                inside_m = self.radius_m - distance_m
                self.tell("zone", f"the robot is {inside_m:.2f} m inside of {zone.name}")
            zone.holds = zone.holds or distance_m > self.radius_m

    def _judge(self, now_s: float, speed_mps: float, turn_radps: float) -> None:
        moves = speed_mps > MOVES_MPS or turn_radps > TURNS_RADPS
        alone_s, age_s = now_s - self._live_s, now_s - self._fused_s
        if moves and alone_s > STANDS_AFTER_S:
            self.tell("request", f"it moves {alone_s:.2f} s after the last living request")
        if speed_mps > MOVES_MPS and age_s > MAX_DATA_AGE_S:
            self.tell("age", f"it drives at {speed_mps:.2f} m/s on a map of {age_s:.2f} s ago")

    def _request_lives(self) -> bool:
        """Whether a planner that runs has accepted a request that has not ended."""
        for service in self.system.running("planner"):
            planner = service.worker
            if isinstance(planner, Planner) and not service.process.stalled:
                state = planner._registry.state
                if state is not None and state.search.active:
                    return True
        return False
