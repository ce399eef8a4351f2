"""Runs the demo: starts all processes, searches once, and writes a summary."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from onemap import Client
from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.config import BusConfig, ConfigError
from onemap_shared.messages import SearchState
from onemap_shared.transport import Bus
from onemap_tools.demo.report import describe
from onemap_tools.demo.run_monitor import RunMonitor
from onemap_tools.demo.setup import (
    ROS2_ROBOT,
    SIMULATOR,
    DemoOptions,
    DemoSetup,
    choose_objects,
    failed_document,
    set_up,
)
from onemap_tools.demo.summary import DemoSummary
from onemap_tools.demo.truth import evaluate_result, scene_category, vocabulary_names
from onemap_tools.errors import EXIT_INTERRUPTED, CliError, to_cli_error
from onemap_tools.gateway import SearchHandle, gateway_client
from onemap_tools.processes.interrupts import interruptible
from onemap_tools.processes.launch import Processes
from onemap_tools.processes.network import accepts_connections
from onemap_tools.processes.session import temporary_session
from onemap_tools.progress import ProgressView, progress_of, progress_view

if TYPE_CHECKING:
    from onemap_tools.demo.film.recorder import FilmRecorder

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
        self.began_s = time.monotonic()

    @property
    def elapsed_s(self) -> float:
        """Seconds since the start."""
        return time.monotonic() - self.began_s

    @property
    def overdue(self) -> bool:
        """Whether the time limit has passed."""
        return self.elapsed_s > self.options.time_limit_s

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
        gateway_client(setup.url) as gateway,
    ):
        console.print(f"Starting {len(setup.specs)} processes; logs in {processes.folder}")
        processes.start()
        demo = DemoRun(options, setup, processes, stop)
        while not accepts_connections(setup.endpoint):
            demo.pause()
        with temporary_session(BusConfig(connect=(setup.endpoint,)), "demo", CONNECT_S) as bus:
            monitor = RunMonitor(bus, ROS2_ROBOT if options.ros2 else SIMULATOR)
            with progress_view(console) as view:
                _wait_until_ready(demo, gateway, view)
                targets = _choose_targets(demo, monitor, console)
                console.print(f"Searching for {', '.join(targets.objects)}. Live page: {setup.url}")
                with _filmed(demo, bus, console) as recorder:
                    summary = _search(demo, gateway, monitor, targets, view, recorder=recorder)
            film = options.film if recorder is not None and recorder.moments else None
            document = _write_results(demo, monitor, summary, film)
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


def _wait_until_ready(demo: DemoRun, gateway: Client, view: ProgressView) -> None:
    while missing := gateway.missing_stage():
        if demo.overdue:
            raise CliError(
                f"Not ready after {demo.options.time_limit_s:g} s. {missing} "
                f"The logs are in {demo.processes.folder}."
            )
        view.wait(demo.elapsed_s, missing)
        demo.pause()


def _choose_targets(demo: DemoRun, monitor: RunMonitor, console: Console) -> DemoTargets:
    """The objects to search for; reports those of the user's that the scene does not contain."""
    wanted = demo.options.objects
    truth = monitor.truth(wanted[0] if wanted else "sofa", ())
    categories = truth.categories if truth else ()
    vocabulary = load_vocabulary(SHIPPED)
    objects = wanted or choose_objects(categories, vocabulary_names(vocabulary))
    names = {word: scene_category(word, categories, vocabulary) for word in objects}
    for word, name in names.items():
        if truth is not None and name not in categories:
            unjudged = "" if truth.names_complete else ", without ground truth"
            console.print(
                f"{truth.scene} has nothing that is called {word!r}; it is searched for all "
                f"the same{unjudged}. It has: {', '.join(sorted(categories))}."
            )
    return DemoTargets(objects, names)


@contextmanager
def _filmed(demo: DemoRun, bus: Bus, console: Console) -> Iterator[FilmRecorder | None]:
    """The recorder of a film if the options name one; the film is written at the end."""
    if demo.options.film is None:
        yield None
        return
    from onemap_tools.demo.film.filming import filming

    with filming(demo.options.film, bus, console) as recorder:
        yield recorder


def _search(
    demo: DemoRun,
    gateway: Client,
    monitor: RunMonitor,
    targets: DemoTargets,
    view: ProgressView,
    *,
    recorder: FilmRecorder | None = None,
) -> DemoSummary:
    """Search for the targets until all are finished or the time limit has passed."""
    handle = SearchHandle(gateway.search(targets.objects))
    began_s = time.monotonic()
    monitor.restart(began_s)
    failure = ""
    while handle.active:
        view.show(progress_of(handle.report, monitor.map_updates, monitor.position_m))
        if demo.overdue:
            failure = f"Cancelled after the time limit of {demo.options.time_limit_s:g} s."
            handle.cancel()
            break
        demo.pause()
        monitor.update(time.monotonic())
        if recorder is not None:
            recorder.update(time.monotonic())
        handle.poll()
    search_s = time.monotonic() - began_s
    results = handle.report["results"]
    return DemoSummary(
        wanted=targets.objects,
        objects=tuple(
            evaluate_result(result, targets.scene_categories[result["name"]], monitor.truth)
            for result in results
        ),
        duration_s=demo.elapsed_s,
        search_s=search_s,
        map_rate_hz=monitor.map_rate_hz,
        failure=failure or _failure_reason(handle.report),
        contacts=monitor.contacts,
    )


def _failure_reason(report: dict[str, Any]) -> str:
    """Why the search as a whole failed or was cancelled; empty if it ran to its end."""
    early = report["state"] in (SearchState.FAILED, SearchState.CANCELLED)
    return str(report["reason"]) if early else ""


def _write_results(
    demo: DemoRun, monitor: RunMonitor, summary: DemoSummary, film: Path | None = None
) -> dict[str, Any]:
    """Write the picture and the summary into the run's folder; returns the summary document.

    ``film``: where the film was written, None without one.
    """
    from onemap_tools.demo.picture import write_picture

    folder = demo.options.folder
    picture = None
    view = monitor.map_view()
    if view is not None:
        picture = folder / "map.png"
        write_picture(
            picture,
            view,
            trail_m=monitor.trail_m,
            yaw_rad=monitor.yaw_rad,
            objects=summary.objects,
        )
    scene = str(demo.options.scene) if demo.options.scene else None
    document = {
        **summary.document(),
        "seed": demo.options.seed,
        "scene": scene,
        "picture": str(picture) if picture else None,
        "film": str(film) if film else None,
        "folder": str(folder),
    }
    (folder / "summary.json").write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    return document


def _stay_up(demo: DemoRun, console: Console) -> None:
    """Keep the processes running until Ctrl-C."""
    console.print(f"The robot is yours: {demo.setup.url}   (Ctrl-C ends everything)")
    console.print(f"What is wrong, if anything: onemap doctor --config {demo.setup.config_file}")
    while True:
        try:
            demo.pause()
        except CliError as error:
            if error.exit_code != EXIT_INTERRUPTED:
                raise
            return
