"""One run: a robot that searches in an apartment while the incidents of a plan happen."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.label_renderer import LabelRenderer
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.faults.changes import CHANGES
from onemap_tools.bench.faults.contacts import ShownObstacles
from onemap_tools.bench.faults.plan import ACTS, APARTMENTS, DISKS, SERVICES, FaultPlan, Incident
from onemap_tools.bench.faults.rules import MAX_REST_S, Refused, Rules, Violation
from onemap_tools.bench.faults.user import User
from onemap_tools.bench.navigation.episode import EpisodeSetup, perception, system_config
from onemap_tools.bench.options import NavigationBench
from onemap_tools.virtual.config import SystemConfig
from onemap_tools.virtual.disk import VirtualDisk
from onemap_tools.virtual.link import SENDS_BYTES
from onemap_tools.virtual.network import RETRY_S, VirtualBus
from onemap_tools.virtual.scheduler import NoProgress, VirtualWorld
from onemap_tools.virtual.system import Equipment, VirtualService, VirtualSystem, simulated

PREEMPT = 0.1  # how probably threads change where none has to wait
OBJECT_LIMIT_S = 15.0
RESTART_S = 1.0  # a supervisor waits, before it starts what has ended by itself
QUIET_S = 2.5  # without incident and search, after which a run is over
PRESSES_S = 10.0  # a user asks at the end, until it is answered


@dataclass(frozen=True, slots=True)
class RunResult:
    """How a run went: what did not hold, and figures."""

    broken: tuple[Violation, ...]
    trace: int
    virtual_s: float
    metres: float
    searches: int


@lru_cache(maxsize=APARTMENTS)
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
    disks = {name: VirtualDisk(world, name) for name in DISKS}
    seen = perception(scene, setup, config)
    robot = simulated(scene, config.simulator, renderer)
    equipment = Equipment(config, robot, seen, Path(), disks)
    run = _Run(VirtualSystem(world, equipment), plan, scene, config.simulator)
    try:
        world.run(run.end_s + MAX_REST_S, stop=run.over)
    except NoProgress as problem:
        run.rules.tell("progress", f"time stands still at {problem}")
    broken = run.judged()
    world.close()
    metres, searches = round(run.rules.metres, 2), run.user.searches
    return RunResult(broken, world.trace, round(world.now_s, 3), metres, searches)


def _returns_s(incident: Incident) -> float:
    """Seconds after an incident until every session has found the router again."""
    return RETRY_S[1] if incident.kind in ("router", "cut", "stall", "suspend") else 0.0


class _Run:
    """The incidents of a plan, and a user."""

    def __init__(
        self, system: VirtualSystem, plan: FaultPlan, scene: Scene, config: SimulatorConfig
    ) -> None:
        self.system, self.world, self._plan = system, system.world, plan
        self._disks = system.equipment.disks
        radius_m = config.robot.radius_m
        obstacles = CollisionMap.of(scene, config.robot.height_m)
        self.rules = Rules(system, plan, radius_m, ShownObstacles(obstacles, radius_m))
        names = sorted({thing.category for thing in scene.objects})
        self.user = User(system, self.rules, names, plan)
        ends = (each.at_s + each.lasts_s + _returns_s(each) for each in plan.incidents)
        self.end_s = max((*ends, plan.asks_until_s))
        self._left = dict.fromkeys(SERVICES, 0)  # incidents that keep it from being started
        self._began_s = 0.0  # the process that was started last
        self._done = False
        system.on_exit = self._exited
        for name in SERVICES:
            system.start(name)
        self.rules.begin()
        system.spawn_user(self._use)
        for incident in plan.incidents:
            if incident.kind in ACTS:
                act = partial(self.user.act, incident.kind)
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

    def _use(self, bus: VirtualBus) -> None:
        """What the user does, and what is asked in the end."""
        self.user.search(bus)
        while self.world.now_s < max(self.end_s, self.user.active_s, self._began_s) + QUIET_S:
            bus.clock.sleep(0.1)
        ends_s = self.world.now_s + PRESSES_S
        while True:
            try:
                self.user.ask(bus.clock, "GET", "/v1/searches/current")
            except Refused as problem:
                if problem.code == "unknown_search" or self.world.now_s > ends_s:
                    break
                bus.clock.sleep(0.5)
            else:
                break
        self.rules.check_kept(bus, partial(self.user.ask, bus.clock))
        self._done = True

    # Faults.

    def _begin(self, incident: Incident) -> None:
        kind, name, system = incident.kind, incident.target, self.system
        later = partial(self.world.at, incident.lasts_s)
        if kind == "router":
            system.router.stop()
            later(system.router.start)
        elif kind == "second":
            later(partial(self.world.kill, system.start(name, beside=True).process))
        elif kind == "clock":
            system.skew(SERVICES if name == "all" else (name,), int(incident.amount * 1e9))
        elif kind in CHANGES:
            if kind == "jumping":
                self.rules.poses_lie = True
            system.router.changes[name] = CHANGES[kind](self.world.rng)
            later(partial(system.router.changes.pop, name, None))
        elif kind == "restart":
            system.services[name].life.stop.set()
        elif kind == "kill":
            self._kill(name)
            later(partial(self._restart, name))
        elif kind in ("stall", "suspend"):
            for each in SERVICES if name == "all" else (name,):
                process, suspended = system.services[each].process, kind == "suspend"
                system.router.stall(process, stalled=True)
                later(partial(system.router.stall, process, stalled=False, suspended=suspended))
        elif kind == "power" or kind.startswith("disk"):
            self._change_disk(incident)
        else:
            self._change_link(incident)

    def _change_disk(self, incident: Incident) -> None:
        name, later = incident.target, partial(self.world.at, incident.lasts_s)
        self.rules.unwritten |= name == "planner" and incident.kind != "power"
        if incident.kind == "power":
            for each in SERVICES if name == "all" else (name,):
                self._kill(each)
                if each in self._disks:
                    self._disks[each].lose_power()
                later(partial(self._restart, each))
        elif incident.kind == "disk torn":
            self._kill("mapper")  # what reads it next is another process
            later(partial(self._restart, "mapper"))
            if self._disks["mapper"].damage(name, incident.amount):
                self.rules.torn.add(name)
        elif incident.kind == "disk slow":
            disk = self._disks[name]
            disk.slower = incident.amount
            later(partial(setattr, disk, "slower", 1.0))
        else:
            disk = self._disks[name]
            disk.full = True
            later(partial(setattr, disk, "full", False))

    def _change_link(self, incident: Incident) -> None:
        process, router = self.system.services[incident.target].process, self.system.router
        if incident.kind == "cut":
            router.cut(process, cut=True)
            self.world.at(incident.lasts_s, partial(router.cut, process, cut=False))
            return
        names = {"late": "delay_s", "slow": "bytes_per_s", "lossy": "loss"}
        # What waits: as long as Zenoh does before it drops, or what the kernel and it hold.
        waits = {"slow": incident.amount * 0.4, "lossy": SENDS_BYTES}
        changed = {names[incident.kind]: incident.amount}
        if incident.kind in waits:
            changed["queue_bytes"] = waits[incident.kind]
        for bus in router.sessions_of(process):
            before = {name: getattr(bus.up, name) for name in changed}
            bus.change_link(**changed)
            self.world.at(incident.lasts_s, partial(bus.change_link, **before))

    def _kill(self, name: str) -> None:
        self._left[name] += 1
        self.rules.died(name)
        self.world.kill(self.system.services[name].process)

    def _restart(self, name: str) -> None:
        self._left[name] -= 1
        if not self._left[name] and not self.system.services[name].process.alive:
            self.system.start(name)
            self._began_s = self.world.now_s

    def _exited(self, service: VirtualService, code: int) -> None:
        if self.system.services.get(service.name) is not service:
            return  # a second one, which had to go
        if code:
            self.rules.tell("exit", f"{service.name} ended by itself, with code {code}")
        self._left[service.name] += 1
        self._began_s = self.world.now_s + RESTART_S
        self.world.at(RESTART_S, partial(self._restart, service.name))
