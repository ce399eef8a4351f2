"""Runs the episodes of the benchmark in processes and sums them up."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch

from onemap_tools.bench.commands import result_lines
from onemap_tools.bench.navigation.drawing import apartment_seeds
from onemap_tools.bench.navigation.episode import EpisodeSetup, run_episode
from onemap_tools.bench.navigation.planning import planning_times
from onemap_tools.bench.navigation.results import (
    EPISODE,
    EpisodeRecord,
    ResultsFolder,
    comparison,
    episode_line,
    estimates,
    read_beside,
    summary,
    table_lines,
)
from onemap_tools.bench.options import NavigationBench
from onemap_tools.processes.worker_pool import worker_pool
from onemap_tools.virtual.config import SystemConfig
from onemap_tools.virtual.latency import NO_LATENCIES, Latencies

DESCRIBED = ("onemap", "oracle")  # find the one of several that is meant


def lines(result: dict[str, Any]) -> list[str]:
    """The result for people."""
    planning = result["benchmark"] == "planning"
    return result_lines(result) if planning else table_lines(result)


def setups(options: NavigationBench) -> tuple[EpisodeSetup, ...]:
    """One per episode; ValueError for options that do not fit each other."""
    if options.goals != "names" and options.method not in DESCRIBED:
        raise ValueError(
            f"method {options.method} knows names only: --goals {options.goals} is for "
            f"{', '.join(DESCRIBED)}"
        )
    if options.goals == "colours" and options.features != "mini":
        raise ValueError("labels have no colours: --goals colours is for --features mini")
    seeds = apartment_seeds(options.seed, options.episodes, options.apartments)
    times = _latencies(options)
    return tuple(
        EpisodeSetup(index, _config(options, seed), options, times)
        for index, seed in enumerate(seeds)
    )


def described(options: NavigationBench) -> dict[str, Any]:
    """The options as a JSON object, with the settings of the services."""
    document = asdict(options)
    # What says nothing of the task, or is told by its content:
    for name in ("as_json", "workers", "out", "beside", "config", "planning"):
        del document[name]
    for name in ("zones", "stairwells"):  # beside how many there were in all
        document[f"{name}_per_episode"] = document.pop(name)
    document["latency"] = _latencies(options).model_dump(mode="json")
    config = _config(options, options.seed).document()
    encoder = config["perception"]["encoder"]
    encoder["folder"] = Path(encoder["folder"]).name  # that of another checkout is the same
    return {**document, "limit_s": document.pop("limit"), "config": config}


def _latencies(options: NavigationBench) -> Latencies:
    return NO_LATENCIES if options.latency is None else Latencies.read(options.latency)


def _config(options: NavigationBench, seed: int) -> SystemConfig:
    """The configuration in an apartment, with the errors."""
    errors = {} if options.errors == "none" else {"errors": options.errors}
    return SystemConfig.read(options.config, seed=seed, **errors)


def run(options: NavigationBench, tell: Callable[[str], None]) -> dict[str, Any]:
    """Run what is not yet in the folder; the summary, in which only times of this machine vary."""
    if options.planning:
        return planning_times(options.planning, options.seed)
    started_s = time.perf_counter()
    asked, document = setups(options), described(options)
    plain = json.loads(json.dumps(document))
    others = dict(read_beside(folder, plain) for folder in options.beside or ())
    folder = None if options.out is None else ResultsFolder(options.out, document)
    done = {record.index: record for record in folder.finished} if folder else {}
    todo = [setup for setup in asked if setup.index not in done]
    for finished in run_all(todo, options.workers):
        record = EPISODE.validate_python(finished.document())  # rounded, as one that is read
        done[record.index] = record
        if folder:
            folder.add(record)
        tell(episode_line(record))
    episodes = [done[index] for index in sorted(done)]
    del document["config"]
    result = {
        "benchmark": "navigation",
        **document,
        **summary(episodes, options.seed),
        "compared_with": {
            method: {
                "metrics": estimates(theirs, options.seed),
                "compared": comparison(episodes, theirs, options.seed),
            }
            for method, theirs in others.items()
        },
        "wall_s": round(time.perf_counter() - started_s, 1),
    }
    if folder:
        folder.write_results(result)
    rows = [episode.document() for episode in episodes]
    for row in rows:
        del row["trajectory"]
    return {**result, "results": rows}


def run_all(setups: Sequence[EpisodeSetup], workers: int) -> Iterator[EpisodeRecord]:
    """Run the episodes in ``workers`` processes; yields them as they end."""
    with worker_pool(workers) as pool:
        running = [pool.submit(timed_episode, setup) for setup in setups]
        for each in as_completed(running):
            yield each.result()


def timed_episode(setup: EpisodeSetup) -> EpisodeRecord:
    """Run an episode on one core, with its time in seconds."""
    torch.set_num_threads(1)
    started_s = time.perf_counter()
    record = run_episode(setup)
    return replace(record, wall_s=round(time.perf_counter() - started_s, 1))
