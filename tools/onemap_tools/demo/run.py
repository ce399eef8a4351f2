"""A demo whose processes were started: lets the robots search, and writes a summary."""

from __future__ import annotations

import json
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from math import isnan, nan
from typing import Any, TypeVar
from urllib.request import ProxyHandler, build_opener

from rich.console import Console

from onemap import Client
from onemap_perception.config import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.config import BusConfig, read
from onemap_shared.keys import (
    MAP_REVISION,
    ROBOT_ODOMETRY,
    ROBOT_TRUTH,
    heartbeat,
)
from onemap_shared.messages import (
    MapRevision,
    SearchState,
    Truth,
    TruthRequest,
)
from onemap_shared.rates import mean_rate_hz
from onemap_shared.sentence import Sentence, parse
from onemap_shared.transport import Bus, CallError, Subscription
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.service import open_scene
from onemap_tools.demo.setup import (
    OBJECTS,
    OBJECTS_EACH,
    DemoOptions,
    DemoRobot,
    DemoSetup,
    choose_objects,
)
from onemap_tools.demo.summary import (
    DemoSummary,
    RobotSummary,
    describe,
    evaluate_result,
    names_of_classes,
    scene_category,
)
from onemap_tools.errors import EXIT_INTERRUPTED, CliError
from onemap_tools.gateway import SearchHandle, gateway_client
from onemap_tools.processes.launch import Processes
from onemap_tools.processes.network import accepts_connections
from onemap_tools.processes.session import temporary_session
from onemap_tools.progress import ProgressLines, SearchProgress

M = TypeVar("M")

POLL_S = 0.25
CONNECT_S = 5.0  # the router accepts connections before this wait begins
QUEUE = 512  # messages held between two updates: odometry at 50 Hz for ten seconds
TRUTH_S = 10.0  # long enough for a busy machine to answer


class RobotSearch:
    """A robot: what the bus says of it, and the searches that its gateway was given, in order.

    contacts: those above 0.05 m/s that its simulator has counted; None before it says so.
    compiling: whether the mapper's newest heartbeat says that its start goes on.
    """

    def __init__(self, robot: DemoRobot, gateway: Client, bus: Bus) -> None:
        self.robot, self.gateway, self._bus = robot, gateway, bus
        self._handles: list[SearchHandle] = []
        self._odometry = bus.subscribe(ROBOT_ODOMETRY, QUEUE)
        self._revisions = bus.subscribe(MAP_REVISION, QUEUE)
        self._of_robot = bus.subscribe(heartbeat(robot.process), QUEUE)
        self._of_mapper = bus.subscribe(heartbeat("mapper"))
        self._readings: list[tuple[float, int]] = []  # when, and how many frames the map had
        self._revision: MapRevision | None = None
        self.position_m: tuple[float, float] | None = None  # x, y in the map frame
        self.contacts: int | None = None
        self.compiling = False

    @property
    def active(self) -> bool:
        return bool(self._handles) and self._handles[-1].active

    def begin(self, objects: Sequence[str]) -> None:
        """Search for these objects."""
        self._handles.append(SearchHandle(self.gateway.search(objects)))

    def cancel(self) -> None:
        """End its search, if there is one."""
        if self.active:
            self._handles[-1].cancel()

    def update(self, now_s: float) -> None:
        """Take what the bus brought since the last update, and ask how the search goes.

        now_s: on a monotonic clock. Call it several times a second.
        """
        for odometry in _waiting(self._odometry):
            x, y = odometry.T_map_body[:2, 3].tolist()
            self.position_m = x, y
        for beat in _waiting(self._of_robot):
            if "collisions" in beat.metrics:
                self.contacts = int(beat.metrics["collisions"])
        for beat in _waiting(self._of_mapper):
            self.compiling = beat.starting
        for revision in _waiting(self._revisions):
            self._revision = revision
        if self._revision is not None:
            self._readings.append((now_s, self._revision.frames_fused))
        if self.active:
            self._handles[-1].poll()

    def restart(self, now_s: float) -> None:
        """Measure the map's rate from now on."""
        self.update(now_s)
        self._readings = self._readings[-1:]

    @property
    def map_rate_hz(self) -> float:
        """Frames fused into the map per second since ``restart``; NaN without two readings."""
        times_s, counts = zip(*self._readings, strict=True) if self._readings else ((), ())
        return mean_rate_hz(counts, times_s)

    @property
    def path_length_m(self) -> float:
        """Metres that it drove in its searches."""
        return sum(float(handle.report["path_length_m"]) for handle in self._handles)

    @property
    def progress(self) -> SearchProgress:
        """Its newest search; there must be one."""
        age_s = None
        if self._revision is not None:
            age_s = max(time.time_ns() - self._revision.stamp_ns, 0) / 1e9
        report, rate_hz = self._handles[-1].report, self.map_rate_hz
        return SearchProgress(report, age_s, rate_hz, self.position_m, self.robot.name)

    @property
    def failure(self) -> str:
        """Why a search as a whole did not come to its end; empty if all ran to their end."""
        early = (SearchState.FAILED, SearchState.CANCELLED, SearchState.INTERRUPTED)
        reports = (handle.report for handle in self._handles)
        reason = next((str(r["reason"]) for r in reports if r["state"] in early), "")
        return f"{self.robot.name}: {reason}" if reason and self.robot.name else reason

    def summary(self, scene_categories: dict[str, str]) -> RobotSummary:
        """What it did; scene_categories: the scene's category for each word."""
        reports = [handle.report for handle in self._handles]
        results = [result for report in reports for result in report["results"]]
        return RobotSummary(
            name=self.robot.name,
            objects=tuple(
                evaluate_result(result, scene_categories[result["name"]], self.truth)
                for result in results
            ),
            path_length_m=self.path_length_m,
            search_s=sum(float(report["elapsed_s"]) for report in reports),
            contacts=self.contacts,
        )

    def truth(self, name: str, place_m: tuple[float, ...]) -> Truth | None:
        """Ground truth for a category at a position; None if the robot does not publish it."""
        x, y = place_m[:2] if len(place_m) >= 2 else (0.0, 0.0)
        try:
            return self._bus.call(ROBOT_TRUTH, TruthRequest(name, x, y), TRUTH_S)
        except CallError:
            return None


def noun_of(text: str) -> str:
    """The name of what a sentence describes; the text where the gateway will not understand it."""
    sentence = understood(text)
    return sentence.name if sentence else text


def places_of(text: str) -> tuple[str, ...]:
    """Names of the places that a sentence speaks of."""
    sentence = understood(text)
    if sentence is None:
        return ()
    return (*sentence.detail.inside, *sentence.detail.outside, *sentence.stay_out)


def understood(text: str) -> Sentence | None:
    """A sentence; None where the gateway will not understand it, and say why."""
    try:
        return parse(text)
    except ValueError:
        return None


def _waiting(subscription: Subscription[M]) -> Iterator[M]:
    """All messages in the queue."""
    while (message := subscription.take(0.0)) is not None:
        yield message


@dataclass(frozen=True, slots=True)
class DemoTargets:
    """The objects to search for, in order, and the scene's category for each of them."""

    objects: tuple[str, ...]
    scene_categories: dict[str, str]


class DemoRun:
    """A demo whose processes run: from the wait until they are ready to the summary.

    began_s: when the command was given, on a monotonic clock.
    """

    def __init__(
        self,
        options: DemoOptions,
        setup: DemoSetup,
        processes: Processes,
        stop: threading.Event,
        began_s: float,
    ) -> None:
        self.options, self.setup = options, setup
        self.processes, self.stop = processes, stop
        self.searches: list[RobotSearch] = []
        self.began_s, self._limit_from_s = began_s, time.monotonic()

    @property
    def overdue(self) -> bool:
        """Whether the time limit has passed since the start, or since the mapper compiled."""
        return time.monotonic() - self._limit_from_s > self.options.time_limit_s

    def pause(self) -> None:
        """Wait ``POLL_S``; raises CliError if a process ended or the user pressed Ctrl-C."""
        if self.stop.wait(POLL_S):
            raise CliError("Stopped.", EXIT_INTERRUPTED)
        self._check_processes()

    def _check_processes(self) -> None:
        for ended in self.processes.collect(time.monotonic()):
            raise CliError(ended.report)

    def join(self, stack: ExitStack) -> None:
        """Join bus and gateway for each robot; left with ``stack``."""
        while not accepts_connections(self.setup.endpoint):
            self.pause()
        for robot in self.setup.robots:
            config = BusConfig(connect=(self.setup.endpoint,), namespace=robot.namespace)
            bus = stack.enter_context(temporary_session(config, "demo", CONNECT_S))
            gateway = stack.enter_context(gateway_client(self.setup.url_of(robot)))
            self.searches.append(RobotSearch(robot, gateway, bus))

    def wait_until_ready(self, lines: ProgressLines) -> None:
        """Show what is missing; CliError after the time limit, which restarts after compiling."""
        while missing := self._missing():
            for search in self.searches:
                search.update(time.monotonic())
                if search.compiling:
                    self._limit_from_s = time.monotonic()
            if self.overdue:
                raise CliError(
                    f"Not ready after {self.options.time_limit_s:g} s. {missing} "
                    f"The logs are in {self.processes.folder}."
                )
            lines.wait(time.monotonic() - self.began_s, missing)
            self.pause()

    def _missing(self) -> str:
        """What the first robot that is not ready lacks, in a sentence; empty if all are ready."""
        for search in self.searches:
            if missing := search.gateway.missing_stage():
                return f"{search.robot.name}: {missing}" if search.robot.name else missing
        return ""

    def choose_targets(self, console: Console) -> DemoTargets:
        """The objects to search for; reports those of the user's that the scene does not contain.

        OneMapError if there are several robots and perception does not know a word: the planner
        says so when a search begins, which for some words is minutes later.
        """
        wanted, several = self.options.objects, len(self.searches) > 1
        truth = self.searches[0].truth("", ())
        categories = truth.categories if truth else ()
        vocabulary = load_vocabulary(SHIPPED)
        known = {name for names in names_of_classes(vocabulary) for name in names}
        count = OBJECTS_EACH * len(self.searches) if several else OBJECTS
        objects = wanted or choose_objects(categories, known, count)
        self._name_rooms(objects)
        nouns = dict.fromkeys(map(noun_of, objects))
        names = {word: scene_category(word, categories, vocabulary) for word in nouns}
        if not nouns.keys() >= set(objects):
            console.print("Only the name in a sentence is judged: any object of that name counts.")
        for word, name in names.items():
            if truth is not None and name not in categories:
                unjudged = "" if truth.names_complete else ", without ground truth"
                console.print(
                    f"{truth.scene} has nothing that is called {word!r}; it is searched for all "
                    f"the same{unjudged}. It has: {', '.join(sorted(categories))}."
                )
        if several:
            self.searches[0].gateway.query_all(objects)
        return DemoTargets(objects, names)

    def _name_rooms(self, sentences: Sequence[str]) -> None:
        """Name the rooms that sentences speak of, where the apartment has one of the kind."""
        names = {name for sentence in sentences for name in places_of(sentence)}
        if not names:
            return
        section = read(self.setup.config_file, {})["simulator"]
        rooms = open_scene(SimulatorConfig.model_validate(section)).rooms
        kinds = [room.kind for room in rooms]
        for room in rooms:
            if room.kind in names and kinds.count(room.kind) == 1:
                x_min, y_min, x_max, y_max = room.bounds_m
                corners_m = ((x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max))
                self.searches[0].gateway.name_place(room.kind, corners_m=corners_m)

    def search(self, targets: DemoTargets, lines: ProgressLines) -> DemoSummary:
        """Search for the targets until all are finished or the time limit has passed.

        Several robots take them in turn: one that has finished with its object takes the next.
        """
        alone = len(self.searches) == 1
        rounds = deque([targets.objects] if alone else [(name,) for name in targets.objects])
        began_s = time.monotonic()
        for search in self.searches:
            search.restart(began_s)
        failure, first_metre_s = "", nan
        while self._deal(rounds):
            for search in self.searches:
                if search.active:
                    lines.show(search.progress)
            if self.overdue:
                failure = f"Cancelled after the time limit of {self.options.time_limit_s:g} s."
                for search in self.searches:
                    search.cancel()
                break
            self.pause()
            for search in self.searches:
                search.update(time.monotonic())
            if isnan(first_metre_s) and any(each.path_length_m >= 1.0 for each in self.searches):
                first_metre_s = time.monotonic() - self.began_s
        now_s = time.monotonic()
        return DemoSummary(
            wanted=tuple(map(noun_of, targets.objects)),
            robots=tuple(search.summary(targets.scene_categories) for search in self.searches),
            duration_s=now_s - self.began_s,
            search_s=now_s - began_s,
            map_rate_hz=self.searches[0].map_rate_hz,
            failure=failure or "; ".join(each.failure for each in self.searches if each.failure),
            first_metre_s=first_metre_s,
        )

    def _deal(self, rounds: deque[tuple[str, ...]]) -> bool:
        """Give the next rounds to the robots that are free; whether any robot searches."""
        for search in self.searches:
            if rounds and not search.active:
                search.begin(rounds.popleft())
        return any(search.active for search in self.searches)

    def run(self, console: Console) -> dict[str, Any]:
        """All of it; returns the document."""
        with ExitStack() as stack:
            self.join(stack)
            lines = ProgressLines(console)
            self.wait_until_ready(lines)
            targets = self.choose_targets(console)
            console.print(f"Searching for {', '.join(targets.objects)}. {self.setup.pages}")
            summary = self.search(targets, lines)
            document = self.write_results(summary.document())
            describe(summary, document["picture"], console)
            return document

    def write_results(self, results: Mapping[str, Any]) -> dict[str, Any]:
        """Write the picture and the summary into the run's folder; returns the document."""
        folder, drawn = self.options.folder, self.map_picture()
        picture = folder / "map.png"
        if drawn is not None:
            picture.write_bytes(drawn)
        scene = self.options.scene
        document = {
            **results,
            "seed": self.options.seed,
            "scene": str(scene) if scene else None,
            "picture": None if drawn is None else str(picture),
            "folder": str(folder),
        }
        text = json.dumps(document, indent=2) + "\n"
        (folder / "summary.json").write_text(text, encoding="utf-8")
        return document

    def map_picture(self) -> bytes | None:
        """A PNG of the map with way and finds, as the gateway draws it; None without a map."""
        url = f"{self.setup.url_of(self.setup.robots[0])}/v1/map.png"
        here = build_opener(ProxyHandler({}))  # a proxy knows no address of this machine
        try:
            with here.open(url, timeout=TRUTH_S) as reply:
                picture: bytes = reply.read()
                return picture
        except OSError:  # as urllib's errors are
            return None

    def stay_up(self, console: Console) -> None:
        """Keep the processes running until Ctrl-C."""
        yours = "The robot is yours" if len(self.setup.robots) == 1 else "The robots are yours"
        console.print(f"{yours}. {self.setup.pages}   (Ctrl-C ends everything)", soft_wrap=True)
        url = self.setup.url_of(self.setup.robots[0])
        console.print(f"Ask from another shell: onemap query sofa --url {url}", soft_wrap=True)
        console.print(
            f"What is wrong, if anything: onemap doctor --config {self.setup.config_file}",
            soft_wrap=True,
        )
        while not self.stop.wait(POLL_S):
            self._check_processes()
