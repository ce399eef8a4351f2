"""``onemap demo``: everything on this machine, one search, a summary."""

from __future__ import annotations

import json
import threading
import time
from dataclasses import dataclass
from typing import Any

from rich.console import Console

from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.config import BusConfig, ConfigError
from onemap_shared.messages import SearchState
from onemap_tools.cli.command_group import to_cli_error
from onemap_tools.cli.progress import ProgressView, progress_view
from onemap_tools.cli.search import SearchHandle, progress_of
from onemap_tools.client import GatewayClient
from onemap_tools.demo.report import describe
from onemap_tools.demo.run_monitor import RunMonitor
from onemap_tools.demo.setup import DemoOptions, DemoSetup, choose_objects, failed_document, set_up
from onemap_tools.demo.summary import DemoSummary
from onemap_tools.demo.truth import judged, scene_category, vocabulary_names
from onemap_tools.errors import EXIT_INTERRUPTED, CliError
from onemap_tools.processes.interrupts import interruptible
from onemap_tools.processes.launch import Processes
from onemap_tools.processes.network import accepts_connections
from onemap_tools.processes.session import temporary_session

POLL_S = 0.25
JOIN_S = 5.0  # the router listens by then


class DemoRun:
    """One demo run: the processes, the doors to them, and the time it may take."""

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
        """Whether the time limit is over."""
        return self.elapsed_s > self.options.time_limit_s

    def pause(self) -> None:
        """Wait a moment; raises CliError if a process died or the user wants to stop."""
        self.stop.wait(POLL_S)
        if self.stop.is_set():
            raise CliError("Stopped.", EXIT_INTERRUPTED)
        for ended in self.processes.collect(time.monotonic()):
            raise CliError(f"{ended.sentence}. Its last lines:\n{ended.tail}")


def run(options: DemoOptions, console: Console) -> dict[str, Any]:
    """Run the demo; returns the summary as JSON can carry it.

    Stays up with the live page until Ctrl-C unless it is headless.
    """
    setup = set_up(options)
    with (
        Processes(setup.specs, options.folder / "logs", setup.environment) as processes,
        interruptible(processes.kill) as stop,
        GatewayClient(setup.url) as gateway,
    ):
        console.print(f"Starting {len(setup.specs)} processes; logs in {processes.folder}")
        processes.start()
        demo = DemoRun(options, setup, processes, stop)
        while not accepts_connections(setup.endpoint):
            demo.pause()
        with temporary_session(BusConfig(connect=(setup.endpoint,)), "demo", JOIN_S) as bus:
            monitor = RunMonitor(bus)
            with progress_view(console) as view:
                _wait_until_ready(demo, gateway, view)
                targets = _choose_targets(demo, monitor, console)
                console.print(f"Searching for {', '.join(targets.objects)}. Live page: {setup.url}")
                summary = _search(demo, gateway, monitor, targets, view)
            document = _write_results(demo, monitor, summary)
        describe(summary, document, console)
        if not options.headless:
            _stay_up(demo, console)
    return document


def run_with_report(options: DemoOptions, console: Console) -> dict[str, Any]:
    """Run the demo; CliError carries a summary of what did not come about, for JSON."""
    try:
        return run(options, console)
    except (CliError, ConfigError) as problem:
        trouble = to_cli_error(problem)
        document = failed_document(options, str(trouble))
        raise CliError(str(trouble), trouble.exit_code, document) from problem


def _wait_until_ready(demo: DemoRun, gateway: GatewayClient, view: ProgressView) -> None:
    while missing := gateway.missing_stage():
        if demo.overdue:
            raise CliError(
                f"Not ready after {demo.options.time_limit_s:g} s. {missing} "
                f"The logs are in {demo.processes.folder}."
            )
        view.wait(demo.elapsed_s, missing)
        demo.pause()


@dataclass(frozen=True, slots=True)
class DemoTargets:
    """What is searched for, in order, and what the scene calls each of these words."""

    objects: tuple[str, ...]
    scene_categories: dict[str, str]


def _choose_targets(demo: DemoRun, monitor: RunMonitor, console: Console) -> DemoTargets:
    """What to look for; tells which of the user's wishes the scene does not hold."""
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


def _search(
    demo: DemoRun,
    gateway: GatewayClient,
    monitor: RunMonitor,
    targets: DemoTargets,
    view: ProgressView,
) -> DemoSummary:
    handle = SearchHandle(gateway, gateway.start_search(targets.objects))
    began_s = time.monotonic()
    monitor.begin(began_s)
    trouble = ""
    while handle.active:
        view.show(progress_of(handle.report, monitor))
        if demo.overdue:
            trouble = f"Cancelled after the time limit of {demo.options.time_limit_s:g} s."
            handle.cancel()
            break
        demo.pause()
        monitor.look(time.monotonic())
        handle.poll()
    search_s = time.monotonic() - began_s
    results = handle.report["results"]
    return DemoSummary(
        wanted=targets.objects,
        objects=tuple(
            judged(result, targets.scene_categories[result["name"]], monitor.truth)
            for result in results
        ),
        duration_s=demo.elapsed_s,
        search_s=search_s,
        map_rate_hz=monitor.map_rate_hz,
        trouble=trouble or _why_it_failed(handle.report),
    )


def _why_it_failed(search: dict[str, Any]) -> str:
    """The reason of a search that ended early; objects not found speak for themselves."""
    early = search["state"] in (SearchState.FAILED, SearchState.CANCELLED)
    return str(search["reason"]) if early else ""


def _write_results(demo: DemoRun, monitor: RunMonitor, summary: DemoSummary) -> dict[str, Any]:
    """Write picture and summary into the run's folder; returns the summary document."""
    from onemap_tools.demo.picture import write_picture

    folder = demo.options.folder
    picture = None
    view = monitor.map_view()
    if view is not None:
        picture = folder / "map.png"
        write_picture(
            picture,
            view,
            track_m=monitor.track_m,
            yaw_rad=monitor.yaw_rad,
            objects=summary.objects,
        )
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
    console.print(f"The robot is yours: {demo.setup.url}   (Ctrl-C ends everything)")
    while True:
        try:
            demo.pause()
        except CliError as end:
            if end.exit_code != EXIT_INTERRUPTED:
                raise
            return
