"""A robot's services in virtual time: the workers that a robot runs, each in a process of its own.

The simulator, perception, the mapper and the planner start, join the bus and work through the same
functions of ``runner`` as in an operating system, and end when they are killed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from onemap_gateway.config import GatewayConfig
from onemap_mapper.config import MapperConfig
from onemap_mapper.robots import buses_of
from onemap_mapper.service import Mapper
from onemap_perception.config import PerceptionConfig
from onemap_perception.service import Perception, PerceptionComponents
from onemap_planner.config import PlannerConfig
from onemap_planner.method import ONEMAP, PlanningMethod
from onemap_planner.service import Planner
from onemap_shared.clock import Event
from onemap_shared.config import BusConfig, Sections
from onemap_shared.runner import (
    EXIT_CRASHED,
    JoiningBus,
    ProcessLife,
    ServiceParts,
    StartError,
    serve,
)
from onemap_shared.services import ROBOTS
from onemap_shared.transport import Bus, Worker
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.rendering.rgbd_camera import SceneRenderer
from onemap_simulator.scene.scene import Scene
from onemap_simulator.service import SimulatorWorker
from onemap_tools.virtual.asgi import VirtualGateway
from onemap_tools.virtual.config import SystemConfig
from onemap_tools.virtual.disk import VirtualDisk
from onemap_tools.virtual.latency import NO_LATENCIES, Delays, LateMethod, Latencies
from onemap_tools.virtual.link import Link
from onemap_tools.virtual.network import RETRY_S, VirtualBus, VirtualRouter
from onemap_tools.virtual.primitives import VirtualClock
from onemap_tools.virtual.scheduler import Process, VirtualWorld

SERVICES = ("simulator", "perception", "mapper", "planner")
FRAMES_UNDER_WAY = 2  # over a link, as docs/links.md sets it


@dataclass(eq=False)
class VirtualService:
    """A service as its supervisor sees it: its process now, and how each one before ended."""

    name: str
    process: Process
    life: ProcessLife
    worker: Worker | None = None  # of the process, once it is built
    codes: list[int] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Equipment:
    """What the services of one robot work with; processes that are started anew share it.

    robot: makes its driver; folder: of the mapper's files and the planner's records, where their
    computers have no virtual ``disks``, by service; method: of the planner; latencies: how long
    stages compute; link: between perception and the router, each way.
    """

    config: SystemConfig
    robot: Callable[[Bus], Worker]
    perception: PerceptionComponents
    folder: Path
    disks: Mapping[str, VirtualDisk] = field(default_factory=dict)
    method: PlanningMethod = ONEMAP
    latencies: Latencies = NO_LATENCIES
    link: Link | None = None

    def parts(self, service: str) -> ServiceParts[Any]:
        """The model of a service's configuration, and what builds its worker."""
        models: dict[str, type[BaseModel]] = {
            **dict.fromkeys(ROBOTS, SimulatorConfig),
            "perception": PerceptionConfig,
            "mapper": MapperConfig,
            "planner": PlannerConfig,
            "gateway": GatewayConfig,
        }
        return ServiceParts(models[service], lambda bus, _: self.worker(service, bus))

    def worker(self, service: str, bus: Bus) -> Worker:
        """The service's worker on this bus."""
        config, delays = self.config, Delays(self.latencies, bus.clock)
        if service == "gateway":
            return VirtualGateway(bus, GatewayConfig())
        if service in ROBOTS:
            return self.robot(bus)
        if service == "perception":
            return Perception(bus, delays.components(self.perception))
        if service == "mapper":
            folder = self._root(service) / "maps"
            mapper = config.mapper.model_copy(update={"map_folder": folder})
            return Mapper(buses_of(bus, mapper.robots), mapper, delays.update)
        planner = config.planner.model_copy(update={"state_dir": self._root(service) / "planner"})
        return Planner(bus, planner, LateMethod(self.method, delays))

    @property
    def sections(self) -> Sections:
        """What the processes read of a file of configuration: over a link, frames are paced."""
        window = {"bus": {"link": {"window": FRAMES_UNDER_WAY}}}
        return Sections({} if self.link is None else window, "")

    def _root(self, service: str) -> Path:
        return self.disks[service].root if service in self.disks else self.folder


def simulated(
    scene: Scene, config: SimulatorConfig, renderer: SceneRenderer | None = None
) -> Callable[[Bus], Worker]:
    """Makes the simulator's robot in a scene; renderer: None for the usual one."""
    return lambda bus: SimulatorWorker(bus, scene, config, renderer)


class VirtualSystem:
    """The services of one robot, started by name, and a user's session."""

    def __init__(self, world: VirtualWorld, equipment: Equipment) -> None:
        self.world, self.router = world, VirtualRouter(world)
        self.equipment = equipment
        self.services: dict[str, VirtualService] = {}
        self._started: list[VirtualService] = []
        self.on_exit: Callable[[VirtualService, int], object] = lambda _service, _code: None
        self._skew_ns: dict[str, int] = {}  # by service
        self.user: VirtualBus = self.router.join(world.process("user"), "user", announce=False)

    def start(self, name: str, *, beside: bool = False) -> VirtualService:
        """Start a process of a service; ``beside``: the one that is there stays the one."""
        process = self.world.process(name)
        process.skew_ns = self._skew_ns.get(name, 0)
        life = ProcessLife(name, VirtualClock(self.world, process))
        before = self.services.get(name)
        service = VirtualService(name, process, life, codes=before.codes if before else [])
        self._started.append(service)
        if not beside:
            self.services[name] = service
        self.world.spawn(process, "main", partial(self._main, service))
        return service

    def start_all(self) -> None:
        """Start every service."""
        for name in SERVICES:
            self.start(name)

    def running(self, name: str) -> list[VirtualService]:
        """The processes of a service that have not ended."""
        return [each for each in self._started if each.name == name and each.process.alive]

    def skew(self, names: Iterable[str], by_ns: int) -> None:
        """Set the wall clocks of these services' computers."""
        for name in names:
            self._skew_ns[name] = self._skew_ns.get(name, 0) + by_ns
            for service in self.running(name):
                service.process.skew_ns += by_ns

    def spawn_user(self, work: Callable[[VirtualBus], object]) -> None:
        """Run what a user does, in a thread of its process."""
        self.world.spawn(self.user.process, "user", partial(work, self.user))

    def _main(self, service: VirtualService) -> None:
        parts = self.equipment.parts(service.name)

        def build(bus: Bus, settings: Any) -> Worker:
            service.worker = parts.build(bus, settings)
            return service.worker

        made = ServiceParts(parts.model, build)
        try:
            connect = partial(self._connect, service.process)
            code = serve(service.life, lambda _: made, self.equipment.sections, connect)
        except StartError:
            code = EXIT_CRASHED
        service.codes.append(code)
        self.on_exit(service, code)
        self.world.kill(service.process)

    def _connect(
        self,
        process: Process,
        config: BusConfig,
        service: str,
        instance: str,
        stop: Event,
        *,
        waiting: Callable[[str], None],
    ) -> JoiningBus | None:
        """As ``bus.open_bus``."""
        bus = VirtualBus(
            self.router, process, service, instance, config.namespace, pace=config.link
        )
        if service == "perception" and self.equipment.link is not None:
            bus.shape(self.equipment.link)
        pause_s = RETRY_S[0]
        while not stop.is_set():
            waiting("waiting for a router")
            try:
                bus.connect()
                return bus
            except ConnectionError:
                stop.wait(pause_s)
                pause_s = min(2 * pause_s, RETRY_S[1])
        return None
