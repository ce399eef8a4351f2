"""Runs Habitat's episodes one after the other and sums them up as the navigation benchmark does."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from onemap_tools.bench.habitat.choices import SuccessRule
from onemap_tools.bench.habitat.episode_files import EpisodeSet, read_episodes
from onemap_tools.bench.habitat.episode_run import EpisodeRun, HabitatSetup
from onemap_tools.bench.habitat.habitat_world import HabitatWorld
from onemap_tools.bench.habitat.tables import paper_tables
from onemap_tools.bench.lockstep import PerceptionPipeline, SystemConfig
from onemap_tools.bench.navigation.choices import Method
from onemap_tools.bench.navigation.metrics import summary
from onemap_tools.bench.navigation.records import EpisodeRecord, episode_record
from onemap_tools.bench.navigation.results_folder import ResultsFolder

Report = Callable[[EpisodeRecord], None]
TABLES_FILE = "tables.md"
BOOTSTRAP_SEED = 0
NO_APARTMENT = (0, "training")  # seed and style of the simulator, which does not run here


@dataclass(frozen=True, slots=True)
class HabitatOptions:
    """What is run. episodes, goals, scenes: as the command has them; count: of the first
    episodes, None: all; limit_s: simulated seconds per object."""

    episodes: Path
    scenes: Path
    goals: Path | None = None
    count: int | None = None
    method: Method = Method.ONEMAP
    rule: SuccessRule = SuccessRule.PAPER
    limit_s: float = 300.0
    config: Path | None = None

    def setup(self) -> HabitatSetup:
        """How each episode is run; ValueError for a method that Habitat's episodes do not have."""
        if self.method is Method.ORACLE:  # needs the simulator's ground truth
            raise ValueError(
                f"--method {self.method.value} runs in generated apartments only: choose another"
            )
        config = SystemConfig.read(self.config, *NO_APARTMENT)
        return HabitatSetup(config, self.method, self.rule, self.scenes, self.limit_s)

    def document(self, setup: HabitatSetup) -> dict[str, Any]:
        """As a JSON object, with the settings of robot, perception, mapper and planner."""
        sections = {
            name: getattr(setup.config, name).model_dump(mode="json")
            for name in ("perception", "mapper", "planner")
        }
        return {
            "method": self.method.value,
            "features": setup.config.perception.encoder.backend,
            "episode_files": str(self.episodes),
            "goals": None if self.goals is None else str(self.goals),
            "count": self.count,
            "success": self.rule.value,
            "limit_s": self.limit_s,
            "config": {**sections, "robot": setup.robot.model_dump(mode="json")},
        }


def run_habitat(options: HabitatOptions, *, out: Path, report: Report) -> dict[str, Any]:
    """Run what is not yet in the folder, write tables, page and JSON there; the summary."""
    setup = options.setup()
    episodes = read_episodes(options.episodes, options.goals, options.count)
    described = options.document(setup)
    folder = ResultsFolder(out, described)
    done = {record.index: record for record in folder.finished}
    if len(done) < len(episodes.episodes):
        _run_missing(episodes, setup, folder, done, report)
    records = [done[index] for index in sorted(done)]
    del described["config"]
    longest = max(len(episode.objects) for episode in episodes.episodes)
    result = {
        "benchmark": "habitat",
        **described,
        "objects_per_episode": longest,
        "about": about(options, len(records), longest),
        **summary(records, BOOTSTRAP_SEED),
        "compared_with": {},
        "wall_s": round(sum(record.wall_s for record in records), 1),
    }
    folder.write_results(result, records)
    (out / TABLES_FILE).write_text(paper_tables(result), encoding="utf-8")
    return result


def about(options: HabitatOptions, episodes: int, objects: int) -> str:
    """Which episodes, by which rule, in one sentence."""
    rule = {
        SuccessRule.PAPER: "less than 1.5 m from the box of an instance",
        SuccessRule.HABITAT: "at most 0.1 m of way from a view point",
    }[options.rule]
    return (
        f"{episodes} episodes of {options.episodes.name} with up to {objects} objects in Habitat, "
        f"found if stopped {rule}."
    )


def _run_missing(
    episodes: EpisodeSet,
    setup: HabitatSetup,
    folder: ResultsFolder,
    done: dict[int, EpisodeRecord],
    report: Report,
) -> None:
    """Run the episodes that are not in ``done``, and add them to it and to the folder."""
    world = HabitatWorld(setup.robot)
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
            report(record)
    finally:
        world.close()
