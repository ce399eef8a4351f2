"""A whole search of a robot's services in virtual time, and what is seen of it from outside."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import dist
from typing import Protocol, TypeVar, cast

from onemap_perception.encoders.protocol import ImageEncoder
from onemap_perception.target_detection import make_target
from onemap_planner.method import PlanningMethod
from onemap_planner.policy.outcome import Observation, Outcome
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.step import step
from onemap_planner.search.state_machine import Search
from onemap_planner.world.map_view import AssembledView, PlanningView
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.geometry import F64
from onemap_shared.keys import Procedure
from onemap_shared.transport import CALL_TIMEOUT_S, Bus, CallError
from onemap_shared.wire import Packet, decode
from onemap_simulator.errors import true_place
from onemap_simulator.service import StampedPose
from onemap_tools.bench.navigation.methods import ONEMAP, ConfidenceValueMap, SearchMethod
from onemap_tools.virtual.network import VirtualBus
from onemap_tools.virtual.scheduler import VirtualWorld
from onemap_tools.virtual.system import Equipment, VirtualService, VirtualSystem

Q = TypeVar("Q")
R = TypeVar("R")

PATH_EVERY_S = 0.05  # 3.5 cm at full speed
ASKED_EVERY_S = 0.1  # until the services are there
STARTED_WITHIN_S = 30.0  # else something is wrong with them
CLEAR_TIMEOUT_S = 1.0


class TrackedRobot(Protocol):
    """pose: the newest that the robot has told, with the true one."""

    pose: StampedPose


@dataclass(frozen=True, slots=True)
class SearchEnd:
    """Reported and true T_map_body (4, 4) when the search for an object ended."""

    T_reported: F64
    T_true: F64

    def true_place(self, place: tuple[float, ...]) -> tuple[float, ...]:
        """Where a place (x, y, ...) truly is that the search told at that time; empty if it is."""
        return place and (*true_place(self.T_reported, self.T_true, place), *place[2:])


class ComparedMethod(PlanningMethod):
    """A method of the benchmark in the planner.

    planning_s: processor time of each step; ends: one for each result of the search; target: the
    object that was begun last.
    """

    def __init__(self, switches: SearchMethod, pose: Callable[[], StampedPose]) -> None:
        self._switches, self._pose = switches, pose
        self.planning_s: list[float] = []
        self.ends: list[SearchEnd] = []
        self.target = ""

    def begin(self, bus: Bus, search: Search) -> None:
        """See ``PlanningMethod``: clears what the method does not keep for the next object."""
        if self._switches.value_map is not None:
            self._switches.value_map.clear()
        if self._switches.forgets and search.index > 0:
            named = bus.call(keys.MAP_PLACES, m.PlacesRequest(), CLEAR_TIMEOUT_S).places
            bus.call(keys.MAP_CLEAR, m.MapClear(), CLEAR_TIMEOUT_S)
            if named:
                bus.call(keys.MAP_CHANGE_PLACES, m.PlacesChange(named), CLEAR_TIMEOUT_S)
        super().begin(bus, search)
        self.target = search.target

    def seen(self, view: PlanningView) -> PlanningView:
        """See ``PlanningMethod``."""
        values, changed = self._switches.value_map, self._switches.view
        if values is None and changed is None:
            return view
        whole = view.whole() if isinstance(view, AssembledView) else view
        if values is not None:
            whole = values.view(whole)
        return whole if changed is None else changed(whole)

    def step(self, state: PlannerState, observation: Observation, params: PlannerParams) -> Outcome:
        """See ``PlanningMethod``."""
        switches, began_s = self._switches, time.process_time()
        outcome = step(state, observation, params, switches.exploration, switches.consensus)
        self.planning_s.append(time.process_time() - began_s)
        while len(outcome.state.search.results) > len(self.ends):
            pose = self._pose()
            self.ends.append(SearchEnd(pose.T_reported, pose.T_true))
        return outcome


class ValueMapper:
    """Feeds a method's value map with what perception publishes of the frames."""

    def __init__(self, values: ConfidenceValueMap, encoder: ImageEncoder) -> None:
        self._values, self._encoder = values, encoder
        self._queries: dict[str, m.TextEmbeddings | None] = {}  # None: an unknown word

    def hear(self, key: str, packet: Packet, name: str) -> None:
        """Take a message; name: of the object that is sought, empty without one."""
        if key != keys.FIELD.key or not name:
            return
        if name not in self._queries:
            self._queries[name] = make_target(self._encoder, name, ()).queries
        if (query := self._queries[name]) is not None:
            self._values.add(decode(m.FeatureField, packet), query)


class WatchedSearch:
    """One search of one robot, from the start of its services on.

    detected: told of each frame in which was looked for the object, and how the search stood.
    path: true positions every ``PATH_EVERY_S`` of the search; trajectory: those of its frames.
    """

    def __init__(
        self,
        equipment: Equipment,
        seed: int,
        *,
        method: SearchMethod = ONEMAP,
        places: Sequence[m.Place] = (),
        detected: Callable[[m.Detections, m.SearchStatus], object] = lambda _found, _status: None,
    ) -> None:
        self.world = VirtualWorld(seed)
        self.method = ComparedMethod(method, lambda: self.robot.pose)
        self.system = VirtualSystem(self.world, replace(equipment, method=self.method))
        self.path: list[tuple[float, float]] = []
        self.trajectory: list[tuple[float, float]] = []
        self.simulated_s = 0.0
        self._places, self._detected, values = tuple(places), detected, method.value_map
        self._values: ValueMapper | None = None
        if values is not None:
            self._values = ValueMapper(values, equipment.perception.encoder)
        self._status: m.SearchStatus | None = None
        self._ended: list[str] = []  # services that did by themselves
        self.system.router.observers.append(self._hear)
        self.system.on_exit = self._exited

    @property
    def robot(self) -> TrackedRobot:
        """The driver of the robot."""
        worker = self.system.services["simulator"].worker
        assert worker is not None
        return cast(TrackedRobot, worker)

    @property
    def xy(self) -> tuple[float, float]:
        """Where the robot truly is, metres."""
        x, y = self.robot.pose.T_true[:2, 3].tolist()
        return x, y

    def driven_m(self, within_s: float) -> float:
        """Metres that the robot drove in the first seconds of the search."""
        path = self.path[: round(within_s / PATH_EVERY_S) + 1]
        return sum(map(dist, path, path[1:]))

    def run(self, request: m.SearchRequest, limit_s: float) -> m.SearchStatus:
        """Search until the search ends or ``limit_s`` have passed since its start."""
        world = self.world
        self.system.start_all()
        self._do(lambda bus: self._start(bus, request), STARTED_WITHIN_S)
        began_s = world.now_s
        self._sample()

        def over() -> bool:
            self._check()
            return self._status is not None and not self._status.active

        world.run(began_s + limit_s, stop=over)
        self.simulated_s = world.now_s - began_s
        return self.status

    @property
    def status(self) -> m.SearchStatus:
        """How the search stands."""
        assert self._status is not None
        return self._status

    def ask(self, procedure: Procedure[Q, R], request: Q) -> R:
        """A service's reply."""
        replies: list[R] = []
        self._do(lambda bus: replies.append(bus.call(procedure, request)), CALL_TIMEOUT_S)
        return replies[0]

    def close(self) -> None:
        """End the services."""
        self.world.close()

    def _do(self, act: Callable[[VirtualBus], object], within_s: float) -> None:
        """Let a user do something, and wait until it is done."""
        done = False

        def work(bus: VirtualBus) -> None:
            nonlocal done
            act(bus)
            done = True

        self.system.spawn_user(work)
        self.world.run(self.world.now_s + within_s, stop=lambda: done)
        self._check()
        if not done:
            raise RuntimeError(f"the services did not answer within {within_s:g} s")

    def _start(self, bus: VirtualBus, request: m.SearchRequest) -> None:
        while True:
            try:
                bus.call(keys.MAP_CHANGE_PLACES, m.PlacesChange(self._places))
                self._status = bus.call(keys.SEARCH_START, request)
            except CallError:  # not there yet
                bus.clock.sleep(ASKED_EVERY_S)
            else:
                return

    def _hear(self, key: str, packet: Packet) -> None:
        if key == keys.SEARCH_STATE.key:
            self._status = decode(m.SearchStatus, packet)
        if self._status is None:
            return
        if key == keys.ROBOT_RGBD.key:
            self.trajectory.append(self.xy)
        elif key == keys.DETECTIONS.key:
            self._detected(decode(m.Detections, packet), self._status)
        if self._values is not None:
            self._values.hear(key, packet, self.method.target)

    def _sample(self) -> None:
        self.path.append(self.xy)
        self.world.at(PATH_EVERY_S, self._sample)

    def _exited(self, service: VirtualService, code: int) -> None:
        self._ended.append(f"{service.name} ended, with code {code}")

    def _check(self) -> None:
        """Raises RuntimeError if a service has failed."""
        for process, thread, problem in self.world.crashes:
            raise RuntimeError(f"{process}, thread {thread} crashed") from problem
        for ended in self._ended:
            raise RuntimeError(ended)
