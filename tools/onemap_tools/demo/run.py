"""Runs the demo: starts all processes, searches once, and writes a summary."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from math import inf
from typing import Any

from rich.console import Console

from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.config import BusConfig, ConfigError
from onemap_tools.demo.report import describe
from onemap_tools.demo.robot_search import RobotSearch, RunMonitor, deal, rounds_of, separation_m
from onemap_tools.demo.robots import DemoRobot
from onemap_tools.demo.setup import (
    OBJECTS,
    OBJECTS_EACH,
    DemoOptions,
    DemoSetup,
    choose_objects,
    failed_document,
    set_up,
)
from onemap_tools.demo.summary import DemoSummary, RobotSummary, in_order, total_contacts
from onemap_tools.demo.truth import evaluate_result, scene_category, vocabulary_names
from onemap_tools.errors import EXIT_INTERRUPTED, CliError, to_cli_error
from onemap_tools.gateway import gateway_client
from onemap_tools.processes.interrupts import interruptible
from onemap_tools.processes.launch import Processes
from onemap_tools.processes.network import accepts_connections
from onemap_tools.processes.session import temporary_session
from onemap_tools.progress import ProgressView, progress_view

POLL_S = 0.25
CONNECT_S = 5.0  # the router accepts connections before this wait begins


class DemoRun:
    """One demo run: its options, its processes and its time limit."""

    def __init__(
        self, options: DemoOptions, setup: DemoSetup, processes: Processes, stop: threading.Event
    ) -> None:
        self.options = options
        self.setup = setup
        self.processes = processes
        self.stop = stop
        self.began_s = self._limit_from_s = time.monotonic()

    @property
    def elapsed_s(self) -> float:
        """Seconds since the start."""
        return time.monotonic() - self.began_s

    @property
    def overdue(self) -> bool:
        """Whether the time limit has passed since the start, or since ``restart_limit``."""
        return time.monotonic() - self._limit_from_s > self.options.time_limit_s

    def restart_limit(self) -> None:
        """Count the time limit from now on."""
        self._limit_from_s = time.monotonic()

    def pause(self) -> None:
        """Wait ``POLL_S``; raises CliError if a process ended or the user pressed Ctrl-C."""
        self.stop.wait(POLL_S)
        if self.stop.is_set():
            raise CliError("Stopped.", EXIT_INTERRUPTED)
        for ended in self.processes.collect(time.monotonic()):
            raise CliError(f"{ended.sentence}. Its last lines:\n{ended.tail}")


@dataclass(frozen=True, slots=True)
class DemoTargets:
    """The objects to search for, in order, and the scene's category for each of them."""

    objects: tuple[str, ...]
    scene_categories: dict[str, str]


def run(options: DemoOptions, console: Console) -> dict[str, Any]:
    """Run the demo; returns the summary as JSON can hold it.

    Unless it is headless, it keeps running with the live page until Ctrl-C.
    """
    setup = set_up(options)
    with (
        Processes(setup.specs, options.folder / "logs", setup.environment) as processes,
        interruptible(processes.kill) as stop,
    ):
        console.print(f"Starting {len(setup.specs)} processes; logs in {processes.folder}")
        processes.start()
        demo = DemoRun(options, setup, processes, stop)
        while not accepts_connections(setup.endpoint):
            demo.pause()
        with ExitStack() as stack:
            searches = [_joined(setup, robot, stack) for robot in setup.robots]
            with progress_view(console) as view:
                _wait_until_ready(demo, searches, view)
                targets = _choose_targets(demo, searches, console)
                _check_words(searches, targets)
                console.print(f"Searching for {', '.join(targets.objects)}. {_pages(setup)}")
                summary = _search(demo, searches, targets, view)
            document = _write_results(demo, searches, summary)
        describe(summary, document, console)
        if not options.headless:
            _stay_up(demo, console)
    return document


def run_with_report(options: DemoOptions, console: Console) -> dict[str, Any]:
    """As ``run``; a CliError holds the summary of the failed run as its JSON document."""
    try:
        return run(options, console)
    except (CliError, ConfigError) as cause:
        error = to_cli_error(cause)
        document = failed_document(options, str(error))
        raise CliError(str(error), error.exit_code, document) from cause


def _joined(setup: DemoSetup, robot: DemoRobot, stack: ExitStack) -> RobotSearch:
    """A robot's part of bus and gateway, left with ``stack``."""
    config = BusConfig(connect=(setup.endpoint,), namespace=robot.namespace)
    bus = stack.enter_context(temporary_session(config, "demo", CONNECT_S))
    gateway = stack.enter_context(gateway_client(setup.url_of(robot)))
    return RobotSearch(robot, gateway, RunMonitor(bus, robot.process))


def _pages(setup: DemoSetup) -> str:
    """Where the live page of each robot is."""
    if len(setup.robots) == 1:
        return f"Live page: {setup.url}"
    pages = (f"{robot.name} {setup.url_of(robot)}/" for robot in setup.robots)
    return f"Live pages: {', '.join(pages)}"


def _wait_until_ready(demo: DemoRun, searches: Sequence[RobotSearch], view: ProgressView) -> None:
    """Show what is missing; CliError after the time limit, which starts anew after compiling."""
    while missing := _missing(searches):
        for search in searches:
            search.monitor.update(time.monotonic())
            if search.monitor.compiling:
                demo.restart_limit()
        if demo.overdue:
            raise CliError(
                f"Not ready after {demo.options.time_limit_s:g} s. {missing} "
                f"The logs are in {demo.processes.folder}."
            )
        view.wait(demo.elapsed_s, missing)
        demo.pause()


def _missing(searches: Sequence[RobotSearch]) -> str:
    """What the first robot that is not ready lacks, in a sentence; empty if all are ready."""
    for search in searches:
        if missing := search.gateway.missing_stage():
            return f"{search.robot.name}: {missing}" if search.robot.name else missing
    return ""


def _choose_targets(
    demo: DemoRun, searches: Sequence[RobotSearch], console: Console
) -> DemoTargets:
    """The objects to search for; reports those of the user's that the scene does not contain."""
    wanted = demo.options.objects
    truth = searches[0].monitor.truth(wanted[0] if wanted else "sofa", ())
    categories = truth.categories if truth else ()
    vocabulary = load_vocabulary(SHIPPED)
    count = OBJECTS if len(searches) == 1 else OBJECTS_EACH * len(searches)
    objects = wanted or choose_objects(categories, vocabulary_names(vocabulary), count)
    names = {word: scene_category(word, categories, vocabulary) for word in objects}
    for word, name in names.items():
        if truth is not None and name not in categories:
            unjudged = "" if truth.names_complete else ", without ground truth"
            console.print(
                f"{truth.scene} has nothing that is called {word!r}; it is searched for all "
                f"the same{unjudged}. It has: {', '.join(sorted(categories))}."
            )
    return DemoTargets(objects, names)


def _check_words(searches: Sequence[RobotSearch], targets: DemoTargets) -> None:
    """OneMapError if perception does not know a word.

    The planner says so when a search begins: with several robots, minutes later for some words.
    """
    if len(searches) > 1:
        searches[0].gateway.query_all(targets.objects)


def _search(
    demo: DemoRun,
    searches: Sequence[RobotSearch],
    targets: DemoTargets,
    view: ProgressView,
) -> DemoSummary:
    """Search for the targets until all are finished or the time limit has passed.

    Several robots take them in turn: one that has finished with its object takes the next.
    """
    rounds = rounds_of(targets.objects, len(searches))
    began_s = time.monotonic()
    for search in searches:
        search.monitor.restart(began_s)
    failure, closest_m = "", inf
    while deal(rounds, searches):
        for search in searches:
            if search.active:
                view.show(search.progress)
        if demo.overdue:
            failure = f"Cancelled after the time limit of {demo.options.time_limit_s:g} s."
            for search in searches:
                search.cancel()
            break
        demo.pause()
        for search in searches:
            search.update(time.monotonic())
        closest_m = min(closest_m, separation_m(searches))
    search_s = time.monotonic() - began_s
    robots = tuple(_robot_summary(search, targets) for search in searches)
    return DemoSummary(
        wanted=targets.objects,
        objects=in_order(targets.objects, robots),
        duration_s=demo.elapsed_s,
        search_s=search_s,
        map_rate_hz=searches[0].monitor.map_rate_hz,
        failure=failure or "; ".join(each.failure for each in searches if each.failure),
        contacts=total_contacts(robots),
        robots=robots if len(robots) > 1 else (),
        closest_m=closest_m,
    )


def _robot_summary(search: RobotSearch, targets: DemoTargets) -> RobotSummary:
    return RobotSummary(
        name=search.robot.name,
        objects=tuple(
            evaluate_result(result, targets.scene_categories[result["name"]], search.monitor.truth)
            for result in search.results
        ),
        path_length_m=search.path_length_m,
        search_s=search.search_s,
        contacts=search.monitor.contacts,
    )


def _write_results(
    demo: DemoRun,
    searches: Sequence[RobotSearch],
    summary: DemoSummary,
) -> dict[str, Any]:
    """Write the picture and the summary into the run's folder; returns the summary document."""
    from onemap_tools.demo.report import DrivenPath, write_picture

    folder = demo.options.folder
    picture = None
    monitors = [search.monitor for search in searches]
    view = monitors[0].map_view()
    if view is not None:
        picture = folder / "map.png"
        drives = [DrivenPath(monitor.trail_m, monitor.yaw_rad) for monitor in monitors]
        write_picture(picture, view, drives, summary.objects)
    scene = str(demo.options.scene) if demo.options.scene else None
    document = {
        **summary.document(),
        "seed": demo.options.seed,
        "scene": scene,
        "picture": str(picture) if picture else None,
        "folder": str(folder),
    }
    (folder / "summary.json").write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    return document


def _stay_up(demo: DemoRun, console: Console) -> None:
    """Keep the processes running until Ctrl-C."""
    yours = "The robot is yours" if len(demo.setup.robots) == 1 else "The robots are yours"
    console.print(f"{yours}. {_pages(demo.setup)}   (Ctrl-C ends everything)")
    console.print(f"What is wrong, if anything: onemap doctor --config {demo.setup.config_file}")
    while True:
        try:
            demo.pause()
        except CliError as error:
            if error.exit_code != EXIT_INTERRUPTED:
                raise
            return
