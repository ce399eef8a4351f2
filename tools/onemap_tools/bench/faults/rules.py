"""What must hold in a run, whatever happens; judged by the truth that only the simulator knows.

Times are those of the virtual world, which no service can read. Limits are those that
``docs/reliability.md`` states, with 0.1 s for looking every ``PERIOD_S``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import hypot
from typing import Any

from onemap_mapper.service import Mapper
from onemap_planner.service import Planner
from onemap_shared import keys
from onemap_shared.messages import (
    MapListRequest,
    MapRevision,
    ObjectListRequest,
    PlacesRequest,
    RgbdFrame,
    SearchId,
    SearchListRequest,
)
from onemap_shared.transport import Bus, CallError, RemoteError
from onemap_shared.wire import Packet, WireError, decode
from onemap_simulator.service import SimulatorWorker
from onemap_tools.virtual.asgi import VirtualGateway
from onemap_tools.virtual.network import process_sessions
from onemap_tools.virtual.scheduler import Process
from onemap_tools.virtual.system import VirtualSystem

PERIOD_S = 0.05
MOVES_MPS, TURNS_RADPS = 0.02, 0.05
STOPPED_S = 1.0  # from a stop to its acknowledgement, unless its way is disturbed
STANDS_AFTER_S = 1.1 + 0.1  # its request, its planner or its link ended
# Twice the longest age of a map ("the world of too long ago"), and until it stands.
MAX_DATA_AGE_S = 2 * 1.5 + STANDS_AFTER_S
ZONE_SLACK_M = 0.03
MAX_REST_S = 100.0  # from the last incident to the end of every search: object limits, patience
WRITTEN_S = 1.0  # a find that a user has seen for so long is on disk
MOST_WAITING = 500  # messages for a process that runs
Ask = Callable[[str, str], dict[str, Any]]


class Refused(Exception):
    """A request was refused, or nobody answered: ``code`` says why."""

    def __init__(self, code: str, what: str) -> None:
        super().__init__(f"{code}: {what}")
        self.code = code


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
    forgotten: int = 0  # times that zones were
    torn: set[str] = field(default_factory=set)  # files that were damaged on disk
    cancelled: set[str] = field(default_factory=set)  # searches
    saved: bool = False  # a map was
    poses_lie: bool = False  # nobody can tell where the robot is
    unwritten: bool = False  # the planner's disk does not take what was found
    finds: dict[tuple[str, str], float] = field(default_factory=dict)  # search, name: when seen
    metres: float = 0.0  # driven
    _driver_of: dict[str, Process] = field(default_factory=dict)  # of searches
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

    def forget_zones(self) -> None:
        """Others take their place."""
        self.zones.clear()
        self.forgotten += 1

    def found(self, search_id: str, name: str) -> None:
        """A user has seen that it was found."""
        self.finds.setdefault((search_id, name), self.system.world.now_s)

    def died(self, service: str) -> None:
        """A process is killed: what was only said a moment before may not be written."""
        now_s = self.system.world.now_s
        if service == "planner":
            for find, seen_s in list(self.finds.items()):
                if now_s - seen_s < WRITTEN_S:
                    del self.finds[find]

    def check_kept(self, bus: Bus, ask: Ask) -> None:
        """What was acknowledged is there, and HTTP says what the services hold."""
        self._check_places(bus)
        self._check_files(bus)
        self._check_finds(bus)
        self._check_http(bus, ask)

    def _check_places(self, bus: Bus) -> None:
        try:
            told = bus.call(keys.MAP_PLACES, PlacesRequest())
        except CallError as problem:
            damaged = isinstance(problem, RemoteError) and self.torn
            if self.zones and not damaged:
                self.tell("kept", f"the places that were acknowledged: {problem}")
            return
        for zone in self.zones:
            if told.get(zone.name) is None:
                self.tell("kept", f"{zone.name} was acknowledged and is gone")

    def _check_files(self, bus: Bus) -> None:
        if not self.saved or "*.npz" in self.torn:
            return
        try:
            (told,) = bus.call(keys.MAP_LIST, MapListRequest("kept")).maps
        except CallError as problem:
            self.tell("kept", f"the map that was saved: {problem}")
            return
        if told.problem:
            self.tell("kept", f"the map that was saved: {told.problem}")

    def _check_finds(self, bus: Bus) -> None:
        if not self.finds or self.unwritten:
            return
        try:
            listed = bus.call(keys.SEARCH_LIST, SearchListRequest()).searches
        except CallError as problem:
            self.tell("kept", f"the searches: {problem}")
            return
        known = {(each.search_id, result.name) for each in listed for result in each.results}
        for search_id, name in self.finds.keys() - known:
            self.tell("kept", f"search {search_id} had found {name!r}, which is gone")

    def _check_http(self, bus: Bus, ask: Ask) -> None:
        """Both are asked at the same time, nearly: nothing happens any more."""
        gateway = self.system.services["gateway"].worker
        if not isinstance(gateway, VirtualGateway):
            return
        try:
            search = bus.call(keys.SEARCH_GET, SearchId(""))
            objects = bus.call(keys.MAP_OBJECTS, ObjectListRequest()).objects
            listed = ask("GET", "/v1/objects")["objects"]
        except (CallError, Refused):
            return
        if {each["id"] for each in listed} != {each.object_id for each in objects}:
            self.tell("http", f"it lists {len(listed)} objects, the mapper {len(objects)}")
        state, map_id = gateway.cache.state, self._map_id()
        shown = state.search.message if state.search else None
        if shown is None or (shown.search_id, shown.state) != (search.search_id, search.state):
            said = f"{shown.search_id} {shown.state}" if shown else "no search"
            self.tell("http", f"it shows {said}, not {search.search_id} {search.state}")
        if map_id and (state.revision is None or state.revision.message.map_id != map_id):
            self.tell("http", "it shows another map than the mapper has")

    def _map_id(self) -> str:
        mapper = self.system.services["mapper"].worker
        return mapper._session.map_id if isinstance(mapper, Mapper) else ""

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
        self._judge_queues()
        if self._request_lives():
            self._live_s = now_s
        simulator = self.system.services["simulator"]
        if not simulator.process.alive or not isinstance(simulator.worker, SimulatorWorker):
            for zone in self.zones:  # another robot stands where that begins
                zone.holds = False
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
            if zone.holds and not self.poses_lie and distance_m < self.radius_m - ZONE_SLACK_M:
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

    def _judge_queues(self) -> None:
        for service in self.system.services.values():
            if service.process.alive and not service.process.stalled:
                for session in process_sessions(service.process):
                    if len(session._came) > MOST_WAITING:
                        self.tell("queue", f"{len(session._came)} wait for {service.name}")

    def _request_lives(self) -> bool:
        """Whether a planner that runs has accepted, for this driver, what has not ended."""
        driver = self.system.services["simulator"].process
        for service in self.system.running("planner"):
            planner = service.worker
            if isinstance(planner, Planner) and not service.process.stalled:
                state = planner._registry.state
                if state is not None and state.search.active:
                    search_id = state.search.search_id
                    return self._driver_of.setdefault(search_id, driver) is driver
        return False
