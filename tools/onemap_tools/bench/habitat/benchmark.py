"""Runs Habitat's episodes one after the other and sums them up as the navigation benchmark does."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, replace
from typing import Any

from onemap_tools.bench.habitat.episode import run_episode
from onemap_tools.bench.habitat.episode_files import read_episodes
from onemap_tools.bench.habitat.world import AgentParams, HabitatWorld
from onemap_tools.bench.lockstep import PerceptionPipeline, SystemConfig
from onemap_tools.bench.navigation.records import EPISODE, summary
from onemap_tools.bench.navigation.results import ResultsFolder, episode_line, table_lines
from onemap_tools.bench.options import HabitatBench

BOOTSTRAP_SEED = 0
lines = table_lines


def run(options: HabitatBench, tell: Callable[[str], None]) -> dict[str, Any]:
    """Run what is not yet in the folder, write page and JSON there; the summary.

    ValueError for a method that Habitat's episodes do not have, and for what cannot be read.
    """
    if options.method == "oracle":  # needs the simulator's ground truth
        raise ValueError("--method oracle runs in generated apartments only: choose another")
    system, agent = SystemConfig.read(options.config), AgentParams()
    files = read_episodes(options.episodes, options.goals, options.count)
    described = {
        "method": options.method,
        "features": system.perception.encoder.backend,
        "episode_files": str(options.episodes),
        "goals": None if options.goals is None else str(options.goals),
        "count": options.count,
        "success": options.success,
        "limit_s": options.limit,
    }
    config = system.document() | asdict(agent)
    del config["simulator"]  # which does not run here
    folder = ResultsFolder(options.out, {**described, "config": config})
    done = {record.index: record for record in folder.finished}
    if todo := [episode for episode in files.episodes if episode.index not in done]:
        with closing(HabitatWorld(agent)) as world:
            perception = PerceptionPipeline(system.perception)
            for episode in todo:
                started_s = time.perf_counter()
                record = run_episode(
                    episode,
                    files.goals,
                    world,
                    options=options,
                    config=system,
                    perception=perception,
                )
                record = replace(record, wall_s=round(time.perf_counter() - started_s, 1))
                record = EPISODE.validate_python(record.document())  # rounded, as one that is read
                done[episode.index] = record
                folder.add(record)
                tell(episode_line(record))
    records = [done[index] for index in sorted(done)]
    result = {
        "benchmark": "habitat",
        **described,
        "objects_per_episode": max(len(episode.objects) for episode in files.episodes),
        **summary(records, BOOTSTRAP_SEED),
        "compared_with": {},
        "wall_s": round(sum(record.wall_s for record in records), 1),
    }
    folder.write_results(result, records)
    return result
