"""A demo whose processes were started: the robot searches, and its simulator judges."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from math import isnan, nan
from typing import Any, TypeVar

from rich.console import Console

from onemap import Client
from onemap_perception.config import SHIPPED
from onemap_perception.text.vocabulary import Vocabulary, load_vocabulary
from onemap_shared.config import BusConfig, read
from onemap_shared.keys import ROBOT_TRUTH, heartbeat
from onemap_shared.messages import SearchState, Truth, TruthRequest
from onemap_shared.names import normalised
from onemap_shared.sentence import Sentence, parse
from onemap_shared.transport import Bus, CallError, Subscription
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.service import open_scene
from onemap_tools.cli.remote import describe_search
from onemap_tools.demo.setup import DemoOptions, DemoSetup, choose_objects
from onemap_tools.errors import EXIT_INTERRUPTED, CliError
from onemap_tools.gateway import SearchHandle, gateway_client
from onemap_tools.judgement import ObjectSummary, evaluate_result, json_value
from onemap_tools.processes.launch import Processes
from onemap_tools.processes.network import accepts_connections
from onemap_tools.processes.session import temporary_session
from onemap_tools.progress import ProgressLines

M = TypeVar("M")

POLL_S = 0.25
CONNECT_S = 5.0  # the router accepts connections before this wait begins
TRUTH_S = 10.0  # long enough for a busy machine to answer
EARLY = (SearchState.FAILED, SearchState.CANCELLED, SearchState.INTERRUPTED)


class SimulatedRobot:
    """What the bus says of the robot beside its searches.

    contacts: those above 0.05 m/s that its simulator has counted; None before it says so.
    compiling: whether the mapper's newest heartbeat says that its start goes on.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._of_simulator = bus.subscribe(heartbeat("simulator"))
        self._of_mapper = bus.subscribe(heartbeat("mapper"))
        self.contacts: int | None = None
        self.compiling = False

    def update(self) -> None:
        """Take what the bus brought since the last update."""
        for beat in _waiting(self._of_simulator):
            if "collisions" in beat.metrics:
                self.contacts = int(beat.metrics["collisions"])
        for beat in _waiting(self._of_mapper):
            self.compiling = beat.starting

    def truth(self, name: str, place_m: tuple[float, ...]) -> Truth | None:
        """Ground truth for a category at a position; None without an answer."""
        x, y = place_m[:2] if len(place_m) >= 2 else (0.0, 0.0)
        try:
            return self._bus.call(ROBOT_TRUTH, TruthRequest(name, x, y), TRUTH_S)
        except CallError:
            return None


def _waiting(subscription: Subscription[M]) -> Iterator[M]:
    """All messages in the queue."""
    while (message := subscription.take(0.0)) is not None:
        yield message


@dataclass(frozen=True, slots=True)
class DemoTargets:
    """The objects to search for, in order, and the scene's category for the name of each."""

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
        self.began_s, self._limit_from_s = began_s, time.monotonic()

    def run(self, console: Console) -> dict[str, Any]:
        """All of it; returns the document, which is in the run's folder too."""
        while not accepts_connections(self.setup.endpoint):
            self.pause()
        config = BusConfig(connect=(self.setup.endpoint,))
        with (
            temporary_session(config, "demo", CONNECT_S) as bus,
            gateway_client(self.setup.url) as gateway,
        ):
            robot, lines = SimulatedRobot(bus), ProgressLines(console)
            self.wait_until_ready(robot, gateway, lines)
            targets = self.choose_targets(robot, gateway, console)
            sought = ", ".join(targets.objects)
            console.print(f"Searching for {sought}. Live page: {self.setup.url}")
            document = self.search(robot, gateway, targets, lines, console)
        text = json.dumps(document, indent=2) + "\n"
        (self.options.folder / "summary.json").write_text(text, encoding="utf-8")
        return document

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

    def wait_until_ready(
        self, robot: SimulatedRobot, gateway: Client, lines: ProgressLines
    ) -> None:
        """Show what is missing; CliError after the time limit, which restarts after compiling."""
        while missing := gateway.missing_stage():
            robot.update()
            if robot.compiling:
                self._limit_from_s = time.monotonic()
            if self.overdue:
                raise CliError(
                    f"Not ready after {self.options.time_limit_s:g} s. {missing} "
                    f"The logs are in {self.processes.folder}."
                )
            lines.wait(time.monotonic() - self.began_s, missing)
            self.pause()

    def choose_targets(
        self, robot: SimulatedRobot, gateway: Client, console: Console
    ) -> DemoTargets:
        """The objects to search for; reports those of the user's that the scene does not contain.

        The rooms that their sentences speak of get a name.
        """
        truth = robot.truth("", ())
        categories = truth.categories if truth else ()
        vocabulary = load_vocabulary(SHIPPED)
        known = {name for names in names_of_classes(vocabulary) for name in names}
        objects = self.options.objects or choose_objects(categories, known)
        self._name_rooms(objects, gateway)
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
        return DemoTargets(objects, names)

    def _name_rooms(self, sentences: Sequence[str], gateway: Client) -> None:
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
                gateway.name_place(room.kind, corners_m=corners_m)

    def search(
        self,
        robot: SimulatedRobot,
        gateway: Client,
        targets: DemoTargets,
        lines: ProgressLines,
        console: Console,
    ) -> dict[str, Any]:
        """Search until the targets are finished or the time limit has passed; print and judge."""
        began_s, failure, first_metre_s = time.monotonic(), "", nan
        handle = SearchHandle(gateway.search(targets.objects))
        while handle.active:
            lines.show(handle.report, gateway)
            if self.overdue:
                failure = f"Cancelled after the time limit of {self.options.time_limit_s:g} s."
                handle.cancel()
                break
            self.pause()
            handle.poll()
            if isnan(first_metre_s) and handle.report["path_length_m"] >= 1.0:
                first_metre_s = time.monotonic() - self.began_s
        robot.update()
        now_s, report = time.monotonic(), handle.report
        if not failure and report["state"] in EARLY:
            failure = str(report["reason"])
        judged = [
            evaluate_result(result, targets.scene_categories[result["name"]], robot.truth)
            for result in report["results"]
        ]
        describe_search(report, console)
        document = {
            **summary(targets.objects, judged, failure),
            "search_s": round(now_s - began_s, 2),
            "duration_s": round(now_s - self.began_s, 2),
            "first_metre_s": json_value(first_metre_s),
            "contacts": robot.contacts,
            "seed": self.options.seed,
            "scene": str(self.options.scene) if self.options.scene else None,
            "folder": str(self.options.folder),
        }
        for sentence in verdict(document, judged):
            console.print(sentence, soft_wrap=True)
        return document

    def stay_up(self, console: Console) -> None:
        """Keep the processes running until Ctrl-C."""
        url = self.setup.url
        for line in (
            f"The robot is yours. Live page: {url} (Ctrl-C ends everything)",
            f"Ask from another shell: onemap query sofa --url {url}",
            f"What is wrong, if anything: onemap doctor --config {self.setup.config_file}",
        ):
            console.print(line, soft_wrap=True)
        while not self.stop.wait(POLL_S):
            self._check_processes()


def summary(wanted: Sequence[str], judged: Sequence[ObjectSummary], failure: str) -> dict[str, Any]:
    """The results as a JSON object. SPL: of those that were not there at the start."""
    found = sum(item.counts_as_found for item in judged)
    spl = [item.spl for item in judged if item.judged and not item.there_at_start]
    return {
        "worked": not failure and found == len(wanted),
        "wanted": list(wanted),
        "found": found,
        "judged": sum(item.judged for item in judged),
        "claimed_wrongly": sum(item.claimed_wrongly for item in judged),
        "objects": [
            item.document() | ({"spl": None} if item.there_at_start else {}) for item in judged
        ],
        "object_spl": round(sum(spl) / len(spl), 4) if spl else None,
        "trouble": failure,
    }


def verdict(document: dict[str, Any], judged: Sequence[ObjectSummary]) -> Iterator[str]:
    """What the simulator says of the claims, and the totals, in sentences."""
    for item in judged:
        if item.claimed_wrongly:
            yield f"{item.name}: the simulator disagrees; nearest to the place is {item.nearest}."
        elif item.claimed and not item.judged:
            yield f"{item.name}: nobody can judge it; nearest to the place is {item.nearest}."
    if document["trouble"]:
        yield document["trouble"]
    yield (
        f"{document['found']} of {len(document['wanted'])} found in {document['search_s']:.0f} s "
        f"({document['duration_s']:.0f} s with starting up); the simulator judged "
        f"{document['judged']}, {document['claimed_wrongly']} claimed wrongly."
    )


def names_of_classes(vocabulary: Vocabulary) -> list[tuple[str, ...]]:
    """All names of each class that the encoder ``mini`` was trained on."""
    return [(c.name, *c.aliases, *c.held_out, *c.query_aliases) for c in vocabulary.classes]


def scene_category(word: str, categories: Collection[str], vocabulary: Vocabulary) -> str:
    """The scene's category for an object that a user calls ``word``.

    The word itself if the scene has that category, else a category that is a synonym in the
    vocabulary ("couch" where the scene has "sofa"), else the word.
    """
    wanted = normalised(word)
    if wanted in categories:
        return wanted
    synonyms = next((names for names in names_of_classes(vocabulary) if wanted in names), ())
    return next((name for name in synonyms if name in categories), wanted)


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
