"""Runs an episode over the real processes, in real time: a check of the lockstep simulation.

Simulator, perception, mapper, planner and gateway run as in the demo, with Zenoh between them; the
search goes through the gateway. Latency, dropped frames and the load of the machine count.
"""

from __future__ import annotations

import tempfile
from dataclasses import asdict, fields, replace
from io import StringIO
from math import inf
from pathlib import Path
from typing import Any

from onemap_tools.bench.navigation.episode_run import (
    OVERALL_LIMIT,
    EpisodeSetup,
    FrameCounts,
    drawn_episode,
    not_sought,
    object_record,
)
from onemap_tools.bench.navigation.episodes import NavigationEpisode
from onemap_tools.bench.navigation.methods import planner_config
from onemap_tools.bench.navigation.records import EpisodeRecord, Failure, ObjectRecord
from onemap_tools.cli.terminal import plain_console
from onemap_tools.demo.run import run
from onemap_tools.demo.setup import DemoOptions
from onemap_tools.demo.summary import ObjectSummary
from onemap_tools.errors import CliError
from onemap_tools.processes.network import any_free_port

READY_S = 120.0  # seconds until the services are ready, on a small computer
LENGTHS = ("shortest_path_m", "true_distance_m", "goal_distance_m")  # null: infinite


def run_in_processes(setup: EpisodeSetup) -> EpisodeRecord:
    """The record of the episode, without a trajectory; ValueError if the services failed."""
    _, _, episode = drawn_episode(setup)
    with tempfile.TemporaryDirectory(prefix="onemap-bench-") as folder:
        options = demo_options(setup, episode, Path(folder) / "run")
        try:
            document = run(options, plain_console(file=StringIO()))
        except CliError as problem:
            raise ValueError(f"the episode of seed {episode.seed} ended: {problem}") from problem
    return process_record(setup.index, episode, document)


def demo_options(setup: EpisodeSetup, episode: NavigationEpisode, folder: Path) -> DemoOptions:
    """The demo with the episode's apartment, start, objects and limits."""
    config = setup.config
    planner = planner_config(config.planner, setup.method, setup.limit_s)
    sections = {
        "simulator": {**config.simulator.model_dump(mode="json"), "start": list(episode.start)},
        "perception": config.perception.model_dump(mode="json"),
        "mapper": config.mapper.model_dump(mode="json"),
        "planner": planner.model_dump(mode="json"),
    }
    return DemoOptions(
        seed=episode.seed,
        scene=None,
        objects=episode.objects,
        headless=True,
        port=any_free_port(),
        folder=folder,
        time_limit_s=READY_S + OVERALL_LIMIT * setup.limit_s * len(episode.objects),
        settings=sections,
    )


def process_record(
    index: int, episode: NavigationEpisode, document: dict[str, Any]
) -> EpisodeRecord:
    """The record of a summary document; objects that the search did not come to are not found."""
    judged = {item["name"]: _object_record(item) for item in document["objects"]}
    missing = {name: _missing_record(name) for name in episode.objects if name not in judged}
    return EpisodeRecord(
        index=index,
        seed=episode.seed,
        start=episode.start,
        objects=tuple((judged | missing)[name] for name in episode.objects),
        contacts=document["contacts"] or 0,
        simulated_s=document["search_s"],
        trajectory=(),
        wall_s=0.0,
    )


def _object_record(item: dict[str, Any]) -> ObjectRecord:
    known = {each.name: item[each.name] for each in fields(ObjectSummary)}
    known |= {name: inf for name in LENGTHS if known[name] is None}
    judged = ObjectSummary(**{**known, "position_m": tuple(item["position_m"])})
    record = object_record(judged, FrameCounts(()))
    unseen = record.failure is Failure.NEVER_IN_VIEW
    return replace(record, failure=Failure.NOT_FOUND) if unseen else record


def _missing_record(name: str) -> ObjectRecord:
    result = asdict(not_sought(name))
    lengths = dict.fromkeys(LENGTHS)
    return _object_record({**result, **lengths, "time_s": 0.0, "nearest": "", "judged": True})
