"""One run: a robot that searches in an apartment while the incidents of a plan happen."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from math import cos, sin
from pathlib import Path
from tempfile import TemporaryDirectory

from onemap_shared import keys
from onemap_shared.messages import (
    MapClear,
    MapFile,
    Place,
    PlaceKind,
    PlacesChange,
    PlacesRequest,
    SearchId,
    SearchRequest,
)
from onemap_shared.transport import CallError
from onemap_shared.wire import Packet
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from onemap_simulator.rendering.label_renderer import LabelRenderer
from onemap_simulator.scene.scene import Scene
from onemap_simulator.service import SimulatorWorker
from onemap_tools.bench.faults.plan import SERVICES, FaultPlan, Incident
from onemap_tools.bench.faults.rules import MAX_REST_S, Rules, Violation, Zone
from onemap_tools.bench.lockstep import SystemConfig
from onemap_tools.bench.navigation.episode import EpisodeSetup, perception, system_config
from onemap_tools.bench.options import NavigationBench
from onemap_tools.virtual.network import VirtualBus
from onemap_tools.virtual.scheduler import NoProgress, VirtualWorld
from onemap_tools.virtual.system import Equipment, VirtualService, VirtualSystem

PREEMPT = 0.1  # how probably threads change where none has to wait
OBJECT_LIMIT_S = 25.0
SEARCHES_UNTIL_S = 42.0  # a user asks again until then
RESTART_S = 1.0  # a supervisor waits, before it starts what has ended by itself
QUIET_S = 3.0  # without incident and search, after which a run is over
ASKS_EVERY_S = 0.5
ZONE_M, AHEAD_M = 0.8, 1.2  # side of a zone, and from the robot to its middle


@dataclass(frozen=True, slots=True)
class RunResult:
    """How a run went: what did not hold, and figures."""

    broken: tuple[Violation, ...]
    trace: int
    virtual_s: float
    metres: float
    searches: int


@lru_cache(maxsize=4)
def apartment(seed: int) -> tuple[EpisodeSetup, Scene, LabelRenderer]:
    """An apartment with what images are made of."""
    options = NavigationBench(limit=OBJECT_LIMIT_S)
    setup = EpisodeSetup(0, SystemConfig.read(None, seed=seed), options)
    scene = generate_apartment(seed, STYLES[setup.config.simulator.style])
    return setup, scene, LabelRenderer(scene)


def run_plan(plan: FaultPlan) -> RunResult:
    """Run a plan in virtual time; the same plan gives the same result."""
    setup, scene, renderer = apartment(plan.apartment)
    config = system_config(setup)
    world = VirtualWorld(plan.seed, preempt=PREEMPT)
    with TemporaryDirectory() as folder:
        equipment = Equipment(
            config, scene, perception(scene, setup, config), Path(folder), renderer
        )
        run = _Run(VirtualSystem(world, equipment), plan, scene, config.simulator.robot.radius_m)
        try:
            world.run(run.end_s + MAX_REST_S, stop=run.over)
        except NoProgress as problem:
            run.rules.tell("progress", f"time stands still at {problem}")
        broken = run.judged()
        world.close()
    rules, searches = run.rules, run.searches
    return RunResult(broken, world.trace, round(world.now_s, 3), round(rules.metres, 2), searches)


Change = Callable[[Packet], list[Packet]]


def disordered(_rng: random.Random) -> Change:
    """Every other message comes after the one that follows it."""
    held: list[Packet] = []

    def change(packet: Packet) -> list[Packet]:
        if held:
            return [packet, held.pop()]
        held.append(packet)
        return []

    return change


def frozen(_rng: random.Random) -> Change:
    """The first message comes again and again."""
    first: list[Packet] = []

    def change(packet: Packet) -> list[Packet]:
        first.append(packet)
        return first[:1]

    return change


def damaged(rng: random.Random) -> Change:
    """In the arrays of every message a byte is another one; names would be another world's."""

    def change(packet: Packet) -> list[Packet]:
        body = bytearray(packet.body)
        if body:
            body[rng.randrange(len(body))] = rng.randrange(256)
        return [Packet(packet.header, bytes(body))]

    return change


CHANGES: dict[str, Callable[[random.Random], Change]] = {
    "doubled": lambda _: lambda packet: [packet, packet],
    "disordered": disordered,
    "frozen": frozen,
    "damaged": damaged,
}


class _Run:
    """The incidents of a plan, and a user who searches until ``SEARCHES_UNTIL_S``."""

    def __init__(
        self, system: VirtualSystem, plan: FaultPlan, scene: Scene, radius_m: float
    ) -> None:
        self.system, self.world, self._plan = system, system.world, plan
        self._rng, self._scene = random.Random(f"user {plan.seed}"), scene
        self.rules = Rules(system, radius_m)
        ends = (each.at_s + each.lasts_s for each in plan.incidents)
        self.end_s = max((*ends, SEARCHES_UNTIL_S))
        self.searches = 0
        self._search_id = ""
        self._active_s = 0.0  # when a search was last active
        self._left = dict.fromkeys(SERVICES, 0)  # incidents that keep it from being started
        self._done = False
        system.on_exit = self._exited
        system.start_all()
        self.rules.begin()
        system.spawn_user(self._search)
        for incident in plan.incidents:
            if incident.kind in ("cancel", "zone", "save", "load", "clear"):
                act = getattr(self, f"_{incident.kind}")
                self.world.at(incident.at_s, partial(system.spawn_user, act))
            else:
                self.world.at(incident.at_s, partial(self._begin, incident))

    def over(self) -> bool:
        """Whether nothing more has to be seen."""
        return self._done

    def judged(self) -> tuple[Violation, ...]:
        """What did not hold."""
        if not self._done:
            self.rules.tell("end", f"a search has not ended {MAX_REST_S:g} s after the incidents")
        for process, thread, problem in self.world.crashes:
            said = f"{type(problem).__name__}: {problem}"
            self.rules.tell("crash", f"{process}, thread {thread}: {said}")
        return tuple(self.rules.broken)

    # Faults.

    def _begin(self, incident: Incident) -> None:
        kind, name, system = incident.kind, incident.target, self.system
        later = partial(self.world.at, incident.lasts_s)
        if kind == "router":
            system.router.stop()
            later(system.router.start)
        elif kind == "second planner":
            later(partial(self.world.kill, system.start("planner", beside=True).process))
        elif kind == "clock":
            system.skew(SERVICES if name == "all" else (name,), int(incident.amount * 1e9))
        elif kind in CHANGES:
            system.router.changes[name] = CHANGES[kind](self.world.rng)
            later(partial(system.router.changes.pop, name, None))
        elif kind == "restart":
            system.services[name].life.stop.set()
        elif kind == "kill":
            self._left[name] += 1
            self.world.kill(system.services[name].process)
            later(partial(self._restart, name))
        elif kind == "stall":
            process = system.services[name].process
            system.router.stall(process, stalled=True)
            later(partial(system.router.stall, process, stalled=False))
        else:
            self._change_link(incident)

    def _change_link(self, incident: Incident) -> None:
        process, router = self.system.services[incident.target].process, self.system.router
        if incident.kind == "cut":
            router.cut(process, cut=True)
            self.world.at(incident.lasts_s, partial(router.cut, process, cut=False))
            return
        names = {"late": "delay_s", "slow": "bytes_per_s", "lossy": "loss"}
        name = names[incident.kind]
        for bus in router.sessions_of(process):
            for link in (bus.up, bus.down):
                before = getattr(link, name)
                setattr(link, name, incident.amount)
                if incident.kind == "slow":
                    link.queue_bytes = incident.amount * 0.4  # as Zenoh waits before it drops
                self.world.at(incident.lasts_s, partial(setattr, link, name, before))

    def _restart(self, name: str) -> None:
        self._left[name] -= 1
        if not self._left[name] and not self.system.services[name].process.alive:
            self.system.start(name)

    def _exited(self, service: VirtualService, code: int) -> None:
        if self.system.services.get(service.name) is not service:
            return  # a second one, which had to go
        if code:
            self.rules.tell("exit", f"{service.name} ended by itself, with code {code}")
        self._left[service.name] += 1
        self.world.at(RESTART_S, partial(self._restart, service.name))

    # What a user does.

    def _search(self, bus: VirtualBus) -> None:
        names = sorted({thing.category for thing in self._scene.objects})
        while True:
            bus.clock.sleep(ASKS_EVERY_S)
            try:
                if self._search_id and self._still_active(bus):
                    self._active_s = self.world.now_s
                elif self.world.now_s < SEARCHES_UNTIL_S:
                    self._search_id = self._start(bus, self._rng.choice(names))
            except CallError:  # it asks again
                continue
            if self.world.now_s > max(self.end_s, self._active_s) + QUIET_S:
                self._check_kept(bus)
                self._done = True
                return

    def _start(self, bus: VirtualBus, name: str) -> str:
        found = bus.call(keys.SEARCH_START, SearchRequest((name,)))
        self.searches += 1
        self._active_s = self.world.now_s
        return found.search_id

    def _still_active(self, bus: VirtualBus) -> bool:
        return bus.call(keys.SEARCH_GET, SearchId(self._search_id)).active

    def _cancel(self, bus: VirtualBus) -> None:
        self._ask(lambda: bus.call(keys.SEARCH_CANCEL, SearchId("")))

    def _save(self, bus: VirtualBus) -> None:
        self._ask(lambda: bus.call(keys.MAP_SAVE, MapFile("kept")))

    def _load(self, bus: VirtualBus) -> None:
        self.rules.zones.clear()  # those of the file take their place
        self._ask(lambda: bus.call(keys.MAP_LOAD, MapFile("kept")))

    def _clear(self, bus: VirtualBus) -> None:
        self.rules.zones.clear()
        self._ask(lambda: bus.call(keys.MAP_CLEAR, MapClear()))

    def _zone(self, bus: VirtualBus) -> None:
        """Draw a keep-out zone ahead of the robot."""
        simulator = self.system.services["simulator"]
        if not isinstance(simulator.worker, SimulatorWorker):
            return
        state = simulator.worker._simulation.state
        x, y, yaw = state.x_m, state.y_m, state.yaw_rad
        middle = x + AHEAD_M * cos(yaw), y + AHEAD_M * sin(yaw)
        (x0, y0), (x1, y1) = ((c - ZONE_M / 2 for c in middle), (c + ZONE_M / 2 for c in middle))
        corners = ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
        name = f"zone {len(self.rules.zones)}"
        place = Place(name, PlaceKind.KEEP_OUT, corners_m=corners)
        if self._ask(lambda: bus.call(keys.MAP_CHANGE_PLACES, PlacesChange((place,)))):
            self.rules.zones.append(Zone(name, (x0, y0, x1, y1)))

    def _check_kept(self, bus: VirtualBus) -> None:
        """What was acknowledged is there."""
        if not self.rules.zones:
            return
        try:
            told = bus.call(keys.MAP_PLACES, PlacesRequest())
        except CallError as problem:
            self.rules.tell("kept", f"the places that were acknowledged: {problem}")
            return
        for zone in self.rules.zones:
            if told.get(zone.name) is None:
                self.rules.tell("kept", f"{zone.name} was acknowledged and is gone")

    def _ask(self, call: Callable[[], object]) -> bool:
        try:
            call()
        except CallError:
            return False
        return True
