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
from onemap_planner.motion.staleness import SET_BACK_S, StalenessParams
from onemap_planner.service import Planner
from onemap_shared import keys
from onemap_shared.command_gate import MAX_COMMAND_AGE_S
from onemap_shared.messages import (
    MapListRequest,
    ObjectListRequest,
    PlacesRequest,
    SearchId,
    SearchListRequest,
    VelocityCommand,
)
from onemap_shared.transport import Bus, CallError, RemoteError
from onemap_shared.wire import Packet, WireError, decode
from onemap_simulator.service import SimulatorWorker
from onemap_tools.bench.faults.contacts import ShownObstacles
from onemap_tools.bench.faults.plan import FaultPlan
from onemap_tools.virtual.asgi import VirtualGateway
from onemap_tools.virtual.network import process_sessions
from onemap_tools.virtual.scheduler import EPOCH_NS, Process
from onemap_tools.virtual.system import VirtualSystem

PERIOD_S = 0.05
MOVES_MPS, TURNS_RADPS = 0.02, 0.05
STOPPED_S = 0.5  # from a stop to its acknowledgement, unless its way is disturbed
STANDS_AFTER_S = 1.1 + 0.1  # its request, its planner or its link ended
LATE_COMMANDS_S = MAX_COMMAND_AGE_S - 0.1  # longer where they wait on their way, and it obeys them
# Of the newest frame that a command rests on, when it passes the router: as old as a plan's may be,
# and the odometry by which the planner tells that; a clock that was set back by less is not seen.
MAX_FRAME_AGE_S = (
    StalenessParams.map_lag_factor * StalenessParams.max_map_age_s
    + StalenessParams.max_view_lag_s
    + MAX_COMMAND_AGE_S
    + SET_BACK_S
)
SHOWS_S = 2.5  # after which HTTP shows what the services have, if nothing lies between them
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
class RobotClock:
    """When the robot's computer had a time, as far as it is known: its clock may be set."""

    _set: list[tuple[float, int]] = field(default_factory=list)  # since when, by how much

    def see(self, now_s: float, skew_ns: int) -> None:
        """How far it is off now."""
        if not self._set or self._set[-1][1] != skew_ns:
            self._set.append((now_s, skew_ns))

    def when(self, stamp_ns: int) -> float | None:
        """The newest moment of this stamp; None if it never was."""
        until_s = float("inf")
        for since_s, skew_ns in reversed(self._set):
            at_s = (stamp_ns - EPOCH_NS - skew_ns) * 1e-9
            if since_s - PERIOD_S <= at_s <= until_s:
                return at_s
            until_s = since_s
        return None


@dataclass(slots=True)
class Rules:
    """Looks at the robot every ``PERIOD_S``; ``broken``: the first violation of each rule."""

    system: VirtualSystem
    plan: FaultPlan
    radius_m: float
    shown: ShownObstacles
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
    _clock: RobotClock = field(default_factory=RobotClock)
    _contacts: int = 0  # so far, of this robot
    _differs_s: float = float("inf")  # since when HTTP shows another search

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
        """Judge a command by the frame that it rests on, if the robot can obey it."""
        if key != keys.ROBOT_CMD_VEL.key:
            return
        now_s = self.system.world.now_s
        try:
            command = decode(VelocityCommand, packet)
        except WireError:  # damaged
            return
        made_s = self._clock.when(command.odometry_stamp_ns)
        if command.velocity.speed_mps <= MOVES_MPS or made_s is None:
            return
        if now_s - made_s > MAX_COMMAND_AGE_S:
            return
        shown_s = self._clock.when(command.frame_ns)
        if command.frame_ns == 0:
            self.tell("age", "a command that moves the robot rests on no frame")
        elif shown_s is not None and now_s - shown_s > MAX_FRAME_AGE_S:
            speed_mps, age_s = command.velocity.speed_mps, now_s - shown_s
            self.tell("age", f"{speed_mps:.2f} m/s are commanded on a frame of {age_s:.2f} s ago")

    def _look(self) -> None:
        self.system.world.at(PERIOD_S, self._look)
        now_s = self.system.world.now_s
        self._judge_queues()
        self._judge_shown_search(now_s)
        self._clock.see(now_s, self.system.services["simulator"].process.skew_ns)
        self._look_at_map(now_s)
        if self._request_lives():
            self._live_s = now_s
        simulator = self.system.services["simulator"]
        if not simulator.process.alive or not isinstance(simulator.worker, SimulatorWorker):
            for zone in self.zones:  # another robot stands where that begins
                zone.holds = False
            self._contacts = 0
            return
        state: Any = simulator.worker._simulation.state
        velocity = state.velocity
        speed_mps = hypot(velocity.linear_mps, velocity.lateral_mps)
        self.metres += speed_mps * PERIOD_S
        if not simulator.process.stalled:
            self._judge(now_s, speed_mps, abs(velocity.angular_radps))
        x_m, y_m = state.pose[:2, 3].tolist()
        contacts = simulator.worker._simulation.counts.collisions
        if contacts > self._contacts and not self.poses_lie:
            touched = self.shown.shown_at(x_m, y_m, now_s)
            if touched is not None:
                where = f"{touched[0]:.2f}, {touched[1]:.2f}"
                self.tell("contact", f"it touches what its map has shown at {where}")
        self._contacts = contacts
        for zone in self.zones:
            distance_m = zone.distance_m(x_m, y_m)
            if zone.holds and not self.poses_lie and distance_m < self.radius_m - ZONE_SLACK_M:
                inside_m = self.radius_m - distance_m
                self.tell("zone", f"the robot is {inside_m:.2f} m inside of {zone.name}")
            zone.holds = zone.holds or distance_m > self.radius_m

    def _judge(self, now_s: float, speed_mps: float, turn_radps: float) -> None:
        moves = speed_mps > MOVES_MPS or turn_radps > TURNS_RADPS
        alone_s = now_s - self._live_s
        late_s = LATE_COMMANDS_S if self.plan.delays_commands else 0.0
        if moves and alone_s > STANDS_AFTER_S + late_s:
            self.tell("request", f"it moves {alone_s:.2f} s after the last living request")

    def _look_at_map(self, now_s: float) -> None:
        mapper = self.system.services["mapper"]
        if mapper.process.alive and isinstance(mapper.worker, Mapper):
            self.shown.look(mapper.worker._session.belief, now_s)
        else:
            self.shown.forget()

    def _judge_shown_search(self, now_s: float) -> None:
        """HTTP shows the planner's search, where nothing has lain between them lately."""
        gateway, planner = self.system.services["gateway"], self.system.services["planner"]
        differs = False
        if (
            isinstance(gateway.worker, VirtualGateway)
            and isinstance(planner.worker, Planner)
            and (state := planner.worker._registry.state) is not None
        ):
            shown = gateway.worker.cache.state.search
            has = state.search.search_id, state.search.active
            differs = shown is None or (shown.message.search_id, shown.message.active) != has
        on_its_way = "gateway", "planner", keys.SEARCH_STATE.key
        if not differs or self.plan.disturbs(on_its_way, now_s, now_s):
            self._differs_s = float("inf")
            return
        self._differs_s = min(self._differs_s, now_s)
        if now_s - self._differs_s > SHOWS_S:
            self.tell("http", f"for {SHOWS_S:g} s it does not show how the search stands")

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
