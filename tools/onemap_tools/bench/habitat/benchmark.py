"""Runs Habitat's episodes one after the other and sums them up as the navigation benchmark does."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

from onemap_tools.bench.habitat.episode import EpisodeRun, HabitatSetup
from onemap_tools.bench.habitat.episode_files import EpisodeFile, read_episodes
from onemap_tools.bench.habitat.world import HabitatWorld
from onemap_tools.bench.lockstep import PerceptionPipeline, SystemConfig
from onemap_tools.bench.navigation.records import EpisodeRecord, episode_record, summary
from onemap_tools.bench.navigation.results import ResultsFolder, episode_line, table_lines
from onemap_tools.bench.options import HabitatBench

BOOTSTRAP_SEED = 0
NO_APARTMENT = (0, "training")  # seed and style of the simulator, which does not run here
lines = table_lines


def setup_of(options: HabitatBench) -> HabitatSetup:
    """How each episode is run; ValueError for a method that Habitat's episodes do not have."""
    if options.method == "oracle":  # needs the simulator's ground truth
        raise ValueError("--method oracle runs in generated apartments only: choose another")
    config = SystemConfig.read(options.config, *NO_APARTMENT)
    return HabitatSetup(options, config)


def run(options: HabitatBench, tell: Callable[[str], None]) -> dict[str, Any]:
    """Run what is not yet in the folder, write page and JSON there; the summary."""
    setup = setup_of(options)
    episodes = read_episodes(options.episodes, options.goals, options.count)
    described = {
        "method": options.method,
        "features": setup.config.perception.encoder.backend,
        "episode_files": str(options.episodes),
        "goals": None if options.goals is None else str(options.goals),
        "count": options.count,
        "success": options.success,
        "limit_s": options.limit,
    }
    config = setup.config.document("perception", "mapper", "planner")
    folder = ResultsFolder(options.out, {**described, "config": config | asdict(setup.agent)})
    done = {record.index: record for record in folder.finished}
    if len(done) < len(episodes.episodes):
        _run_missing(episodes, setup, folder, done, tell)
    records = [done[index] for index in sorted(done)]
    result = {
        "benchmark": "habitat",
        **described,
        "objects_per_episode": max(len(episode.objects) for episode in episodes.episodes),
        **summary(records, BOOTSTRAP_SEED),
        "compared_with": {},
        "wall_s": round(sum(record.wall_s for record in records), 1),
    }
    folder.write_results(result, records)
    return result


def _run_missing(
    episodes: EpisodeFile,
    setup: HabitatSetup,
    folder: ResultsFolder,
    done: dict[int, EpisodeRecord],
    tell: Callable[[str], None],
) -> None:
    """Run the episodes that are not in ``done``, and add them to it and to the folder."""
    world = HabitatWorld(setup.agent)
    perception = PerceptionPipeline(setup.config.perception)
    try:
        for episode in episodes.episodes:
            if episode.index in done:
                continue
            started_s = time.perf_counter()
            record = EpisodeRun(episode, episodes.goals, world, setup, perception).run()
            record = replace(record, wall_s=round(time.perf_counter() - started_s, 1))
            record = episode_record(record.document())  # rounded as one that is read
            done[episode.index] = record
            folder.add(record)
            tell(episode_line(record))
    finally:
        world.close()
