"""Runs the episodes of the benchmark in processes and sums them up."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch

from onemap_shared.messages import SearchOrder
from onemap_tools.bench.lockstep import SystemConfig
from onemap_tools.bench.navigation.choices import Apartments, Errors, Features, Method
from onemap_tools.bench.navigation.comparison import comparison
from onemap_tools.bench.navigation.episode_run import EpisodeSetup, run_episode
from onemap_tools.bench.navigation.episodes import apartment_seeds
from onemap_tools.bench.navigation.errors import with_errors
from onemap_tools.bench.navigation.metrics import estimates, summary
from onemap_tools.bench.navigation.page import picture_name
from onemap_tools.bench.navigation.picture import episode_picture
from onemap_tools.bench.navigation.records import EpisodeRecord, episode_record
from onemap_tools.bench.navigation.results_folder import ResultsFolder, read_beside
from onemap_tools.cli.floor_plan import write_png
from onemap_tools.processes.worker_pool import worker_pool

Report = Callable[[EpisodeRecord], None]


ORDERING = frozenset({Method.ONEMAP, Method.ONEMAP_NO_CONSENSUS})  # their map serves all objects


@dataclass(frozen=True, slots=True)
class NavigationOptions:
    """What is run. limit_s: simulated seconds per object; seed: of the first apartment."""

    method: Method
    features: Features
    episodes: int
    seed: int
    apartments: Apartments = Apartments.ALL
    style: str = "training"
    objects: int = 3
    limit_s: float = 300.0
    config: Path | None = None
    order: SearchOrder = SearchOrder.GIVEN
    errors: Errors = Errors.NONE
    stairwells: int = 0

    def __post_init__(self) -> None:
        if self.order is SearchOrder.ANY and self.method not in ORDERING:
            raise ValueError(
                f"method {self.method.value} knows nothing of the objects that wait: --order any "
                f"is for {' and '.join(sorted(method.value for method in ORDERING))}"
            )

    def setups(self) -> tuple[EpisodeSetup, ...]:
        """One per episode."""
        seeds = apartment_seeds(self.seed, self.episodes, self.apartments)
        return tuple(
            EpisodeSetup(
                index,
                self._sections(seed),
                self.method,
                self.features,
                self.objects,
                self.limit_s,
                self.order,
                self.stairwells,
            )
            for index, seed in enumerate(seeds)
        )

    def document(self) -> dict[str, Any]:
        """As a JSON object, with the settings of the planner and the mapper."""
        config = self._sections(self.seed)
        sections = {
            name: getattr(config, name).model_dump(mode="json")
            for name in ("simulator", "perception", "mapper", "planner")
        }
        return {
            "method": self.method.value,
            "features": self.features.value,
            "errors": self.errors.value,
            **({"stairwells_per_episode": self.stairwells} if self.stairwells else {}),
            "episodes": self.episodes,
            "seed": self.seed,
            "apartments": self.apartments.value,
            "style": self.style,
            "objects_per_episode": self.objects,
            "limit_s": self.limit_s,
            "order": self.order.value,
            "config": sections,
        }

    def _sections(self, seed: int) -> SystemConfig:
        """The configuration in an apartment, with the errors."""
        config = SystemConfig.read(self.config, seed, self.style)
        return replace(config, simulator=with_errors(config.simulator, self.errors))


def run_benchmark(
    options: NavigationOptions,
    *,
    workers: int,
    out: Path | None,
    report: Report,
    beside: Sequence[Path] = (),
) -> dict[str, Any]:
    """Run what is not yet in the folder; the summary, which holds no wall times but ``wall_s``.

    beside: folders of other methods' results, to compare with.
    """
    started_s = time.perf_counter()
    setups, described = options.setups(), options.document()
    others = dict(read_beside(folder, json.loads(json.dumps(described))) for folder in beside)
    folder = None if out is None else ResultsFolder(out, described)
    done = {record.index: record for record in folder.finished} if folder else {}
    todo = [setup for setup in setups if setup.index not in done]
    for finished in run_all(todo, workers, out):
        record = episode_record(finished.document())  # rounded as one that is read from the folder
        done[record.index] = record
        if folder:
            folder.add(record)
        report(record)
    episodes = [done[index] for index in sorted(done)]
    del described["config"]
    result = {
        "benchmark": "navigation",
        **described,
        **summary(episodes, options.seed),
        "compared_with": {
            method: _beside(episodes, theirs, options.seed) for method, theirs in others.items()
        },
        "wall_s": round(time.perf_counter() - started_s, 1),
    }
    if folder:
        folder.write_results(result, episodes)
    return {**result, "results": [_short(episode) for episode in episodes]}


def _beside(
    own: Sequence[EpisodeRecord], other: Sequence[EpisodeRecord], seed: int
) -> dict[str, Any]:
    """The other method's metrics, and own over or less those on the same apartments."""
    return {
        "metrics": {name: each.document() for name, each in estimates(other, seed).items()},
        "compared": {name: each.document() for name, each in comparison(own, other, seed).items()},
    }


def run_all(
    setups: Sequence[EpisodeSetup], workers: int, pictures: Path | None
) -> Iterator[EpisodeRecord]:
    """Run the episodes in ``workers`` processes; yields them as they end.

    pictures: folder for one picture of each.
    """
    with worker_pool(workers) as pool:
        running = [pool.submit(timed_episode, setup, pictures) for setup in setups]
        try:
            for each in as_completed(running):
                yield each.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def timed_episode(setup: EpisodeSetup, pictures: Path | None) -> EpisodeRecord:
    """Run an episode on one core, with its time in seconds, and write its picture."""
    torch.set_num_threads(1)
    started_s = time.perf_counter()
    record = run_episode(setup)
    if pictures is not None:
        simulator = setup.config.simulator
        image = episode_picture(record, simulator.style, simulator.robot)
        write_png(pictures / picture_name(record.index), image)
    return replace(record, wall_s=round(time.perf_counter() - started_s, 1))


def _short(episode: EpisodeRecord) -> dict[str, Any]:
    document = episode.document()
    del document["trajectory"]
    return document
