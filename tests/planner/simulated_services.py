"""The planner on a bus in this process, with a robot, a mapper, a perception and a caller."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from onemap_planner.config import PlannerConfig
from onemap_planner.policy.state import Evidence
from onemap_planner.search.state_machine import Confirming
from onemap_planner.service import Planner
from onemap_planner.world.candidates import ObjectCandidate
from onemap_shared import keys
from onemap_shared.command_gate import CommandGate
from onemap_shared.geometry import pose_2d
from onemap_shared.messages import (
    MapPlaces,
    MapRevision,
    MapSummary,
    Odometry,
    PlacesRequest,
    SearchId,
    SearchKind,
    SearchRequest,
    SearchReset,
    SearchStatus,
    SearchView,
    SearchViewRequest,
    TextEmbeddings,
    TextRequest,
    VelocityCommand,
)
from onemap_shared.places import NOWHERE
from onemap_shared.transport import RequestRejected
from tests.memory_bus import MemoryRouter
from tests.planner.drawn_maps import drawn_map, search_view_of

ROOM = drawn_map("##########", *["#........ "] * 8, "##########", scale=5)
CLOCK_NS = 10**15  # of the robot at its start
STEPS, PATIENCE_S = 400, 90.0  # every wait ends long before both: steps of a busy machine are slow


class SimulatedServices:
    """The planner and, on buses of their own, a robot, a mapper and a caller."""

    def __init__(self, config: PlannerConfig) -> None:
        self.router = MemoryRouter()
        self.robot, self.mapper, self.caller = map(self.router.bus, ("robot", "mapper", "caller"))
        self.odometry = self.robot.publish(keys.ROBOT_ODOMETRY)
        self.revisions = self.mapper.publish(keys.MAP_REVISION)
        self.commands = self.robot.subscribe(keys.ROBOT_CMD_VEL, capacity=1000)
        self.driver, self.gate = self.robot.subscribe(keys.ROBOT_CMD_VEL), CommandGate()
        self.numbers = itertools.count()  # of odometry
        self.states = self.caller.subscribe(keys.SEARCH_STATE, capacity=1000)
        self.paths = self.caller.subscribe(keys.SEARCH_PATH, capacity=1000)
        self.resets: list[str] = []
        self.asked: list[str] = []
        self.answer: Callable[[SearchViewRequest], SearchView] = lambda q: search_view_of(
            ROOM, q.text
        )
        self.mapper.serve(keys.MAP_SEARCH_VIEW, self._view)
        self.mapper.serve(keys.MAP_SEARCH_RESET, self._reset)
        self.serve_places(NOWHERE)
        self.perception = self.router.bus("p")
        self.perception.serve(keys.EMBED_TEXT, embeddings)
        self.config = config
        self.count = self.places_version = self.objects_version = 0
        self.pose, self.offset_m = pose_2d(2.0, 2.0, 0.0), 0.0
        self.map_id = ""
        self.lag_s = 0.0  # of the map's frame behind the odometry
        self.start_planner()

    def start_planner(self) -> None:
        self.planner_bus = self.router.bus("planner")
        self.planner = Planner(self.planner_bus, self.config)

    def restart_driver(self, *, named: bool, joined: bool) -> None:
        """Another process drives the robot; its odometry names it, or it joins the bus, or both."""
        if joined:
            self.robot.close()
            self.robot = self.router.bus("robot")
        name = self.robot.instance if joined else "another"
        self.gate = CommandGate(name if named else "")
        self.numbers = itertools.count()

    def kill_planner(self) -> None:
        """Nothing is tidied up."""
        self.planner._planning_thread.close()
        self.planner_bus.close()

    def serve_places(self, reply: MapPlaces) -> list[int]:
        """Serve these places; the versions that were told so far."""
        told: list[int] = []

        def answer(_: PlacesRequest) -> MapPlaces:
            told.append(reply.version)
            return reply

        self.mapper.serve(keys.MAP_PLACES, answer)
        return told

    def _view(self, request: SearchViewRequest) -> SearchView:
        self.asked.append(request.text)
        return self.answer(request)

    def _reset(self, request: SearchReset) -> MapSummary:
        self.resets.append(request.search_id)
        return MapSummary("", "mini", "mini", 0.1, 1, 1)

    def frame(self, *, odometry: bool = True, revision: bool = True) -> None:
        """One message of each; the planner takes them and waits for its next command."""
        self.count += 1
        stamp_ns = self.newest_ns
        if odometry:
            echo = self._obey(stamp_ns)
            known = Odometry(next(self.numbers), stamp_ns, self.pose, 0.0, 0.0, False, *echo)
            self.odometry.put(replace(known, driver=self.gate.driver))
        if revision:
            shown_ns = stamp_ns - round(self.lag_s * 1e9)
            map_now = MapRevision(
                self.count, self.count, shown_ns, "mini", "mini", 1, 1, 1, 1.0, 4.0
            )
            self.revisions.put(
                replace(
                    map_now,
                    places_version=self.places_version,
                    objects_version=self.objects_version,
                    offset_m=self.offset_m,
                    map_id=self.map_id,
                )
            )
        self.planner.step(0.0)
        self.planner.step(0.05)

    @property
    def newest_ns(self) -> int:
        """Capture time of the newest frame."""
        return CLOCK_NS + self.count * 50_000_000

    def _obey(self, stamp_ns: int) -> tuple[str, int]:
        """The robot takes its newest command; what its odometry says of it."""
        command = self.driver.take(0.0)
        if command is not None:
            self.gate, _ = self.gate.receive(command, time.monotonic(), stamp_ns)
        return self.gate.echo(time.monotonic())

    def until(self, reached: Callable[[], bool], **streams: bool) -> None:
        deadline_s, steps = time.monotonic() + PATIENCE_S, 0
        while not reached():
            late = time.monotonic() > deadline_s and steps > STEPS
            assert not late, f"it did not happen in {steps} steps and {PATIENCE_S:g} s"
            self.frame(**streams)
            steps += 1

    def start(self, *objects: str) -> SearchStatus:
        return self.caller.call(keys.SEARCH_START, SearchRequest(objects))

    def go_to(self, x_m: float, y_m: float) -> SearchStatus:
        request = SearchRequest((), kind=SearchKind.GO_TO, place_m=(x_m, y_m))
        return self.caller.call(keys.SEARCH_START, request)

    def get(self, search_id: str = "") -> SearchStatus:
        return self.caller.call(keys.SEARCH_GET, SearchId(search_id))

    def sent_commands(self) -> list[VelocityCommand]:
        taken = []
        while (command := self.commands.take(0.0)) is not None:
            taken.append(command)
        return taken


def embeddings(request: TextRequest) -> TextEmbeddings:
    """As of an encoder that does not know 'flurb'."""
    if "flurb" in request.texts:
        unknown = {"words": [{"word": "flurb", "did_you_mean": ["curb"]}]}
        raise RequestRejected("unknown_word", "'flurb' (did you mean 'curb'?) is no word", unknown)
    rows = np.ones((len(request.texts), 1), np.float32)
    mask = np.zeros((len(rows), 0), np.uint8)
    return TextEmbeddings("mini", "mini", request.texts, rows, rows[:0], mask, 1.0, 0.2)


def confirm(planner: Planner, candidate: ObjectCandidate) -> None:
    """Let the next step of a running search confirm the candidate, as after enough detections."""
    registry = planner._registry
    swapped = False
    while not swapped:
        state = registry.state
        assert state is not None
        search = replace(state.search, phase=Confirming(candidate, state.active_time_s))
        known = replace(candidate, sightings=candidate.sightings + 100)
        swapped = registry.compare_and_swap(
            state, replace(state, search=search, evidence=Evidence(candidates=(known,)))
        )


def moves(command: VelocityCommand) -> bool:
    """Whether the command is not a stop."""
    return (command.linear_mps, command.angular_radps) != (0.0, 0.0)
