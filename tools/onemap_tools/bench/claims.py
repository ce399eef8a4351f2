"""Searches in generated apartments, each claim judged by the simulator's ground truth."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

import torch

from onemap_mapper.config import MapperConfig
from onemap_perception.config import PerceptionConfig
from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_planner.config import PlannerConfig
from onemap_shared.config import read, section
from onemap_shared.messages import ObjectResult, SearchState, TruthRequest
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from onemap_simulator.ground_truth.truth import truth_reply
from onemap_simulator.parts import scene_truth
from onemap_tools.bench.lockstep import LockstepSimulation, PerceptionPipeline, SystemConfig
from onemap_tools.demo.summary import ObjectSummary
from onemap_tools.demo.truth import evaluate_result, scene_category
from onemap_tools.processes.worker_pool import worker_pool


@dataclass(frozen=True, slots=True)
class EpisodeParams:
    """One search: configuration (seed included), objects, and simulated seconds at most."""

    config: SystemConfig
    objects: tuple[str, ...]
    limit_s: float


@dataclass(frozen=True, slots=True)
class EpisodeResult:
    """The result of one search. present: for each object, whether the apartment holds one."""

    seed: int
    objects: tuple[ObjectSummary, ...]
    present: tuple[bool, ...]
    simulated_s: float
    wall_s: float

    def document(self) -> dict[str, Any]:
        """The episode as a JSON object."""
        pairs = zip(self.objects, self.present, strict=True)
        objects = [{**item.document(), "present": present} for item, present in pairs]
        times = {"simulated_s": round(self.simulated_s, 1), "wall_s": round(self.wall_s, 1)}
        return {"seed": self.seed, "objects": objects, **times}


def run_all(episodes: Sequence[EpisodeParams], workers: int) -> Iterator[EpisodeResult]:
    """Run the searches in ``workers`` processes; yields the results in the order of episodes."""
    with worker_pool(workers) as pool:
        yield from pool.map(run, episodes)


def run(params: EpisodeParams) -> EpisodeResult:
    """Search in simulated time and judge every claim."""
    torch.set_num_threads(1)
    started_s = time.perf_counter()
    simulator = params.config.simulator
    scene = generate_apartment(simulator.seed, STYLES[simulator.style])
    simulation = LockstepSimulation(
        scene, params.config, PerceptionPipeline(params.config.perception)
    )
    search = simulation.search(params.objects, params.limit_s)
    truth = scene_truth(scene, simulator)
    vocabulary = load_vocabulary(SHIPPED)
    names = [scene_category(word, scene.categories, vocabulary) for word in params.objects]
    results = [
        *search.results,
        *(timed_out_result(w) for w in params.objects[len(search.results) :]),
    ]
    return EpisodeResult(
        seed=simulator.seed,
        objects=tuple(
            evaluate_result(
                asdict(result),
                name,
                lambda name, place: truth_reply(truth, TruthRequest(name, *place[:2])),
            )
            for name, result in zip(names, results, strict=True)
        ),
        present=tuple(name in scene.categories for name in names),
        simulated_s=simulation.now_s,
        wall_s=time.perf_counter() - started_s,
    )


def timed_out_result(name: str) -> ObjectResult:
    """The result of an object whose search had not ended at the limit."""
    return ObjectResult(name, SearchState.NOT_FOUND, "the time was over", (), 0.0, 0.0, 0.0, (), ())


def summarise(episodes: Sequence[EpisodeResult], objects: Sequence[str]) -> dict[str, Any]:
    """Counts over all episodes. spl: mean over the objects that are present, 0 where not found."""
    ended = [
        (episode.seed, item, present)
        for episode in episodes
        for item, present in zip(episode.objects, episode.present, strict=True)
    ]
    there = [item for _, item, present in ended if present]
    return {
        "benchmark": "claims",
        "seeds": [episode.seed for episode in episodes],
        "objects": list(objects),
        "sought": len(ended),
        "there": len(there),
        "found": sum(item.success for item in there),
        "claimed_wrongly": sum(item.claimed_wrongly for _, item, _ in ended),
        "absent_and_not_claimed": sum(not p and not item.claimed for _, item, p in ended),
        "spl": round(fmean([item.spl for item in there]), 3) if there else None,
        "wrong": [
            {
                "seed": seed,
                "claimed": item.name,
                "stands_there": item.nearest,
                "stopped_off_m": item.document()["goal_distance_m"],
            }
            for seed, item, _ in ended
            if item.claimed_wrongly
        ],
        "episodes": [episode.document() for episode in episodes],
    }


def episode_line(episode: EpisodeResult) -> str:
    """One episode as a line of text."""
    parts = []
    for item, present in zip(episode.objects, episode.present, strict=True):
        verdict = "found" if item.success else item.outcome.replace("_", " ")
        if item.claimed_wrongly:
            short = f"{item.goal_distance_m:.1f} m short" if present else "none to be found"
            verdict = f"WRONG, {item.nearest} there, {short}"
        elif not present:
            verdict += " (absent)"
        parts.append(f"{item.name}: {verdict}")
    return f"seed {episode.seed}, {episode.simulated_s:.0f} s: {'; '.join(parts)}"


def read_sections(config: Path | None, seed: int, style: str) -> SystemConfig:
    """The sections of a configuration file, in the apartment of a seed and style."""
    sections = read(config)
    simulator = {**sections.get("simulator", {}), "seed": seed, "style": style}
    return SystemConfig(
        simulator=section({"simulator": simulator}, "simulator", SimulatorConfig),
        perception=section(sections, "perception", PerceptionConfig),
        mapper=section(sections, "mapper", MapperConfig),
        planner=section(sections, "planner", PlannerConfig),
    )


def parse_seeds(text: str) -> list[int]:
    """The seeds that ``1-10`` or ``3,5,8`` names; raises ValueError."""
    seeds: list[int] = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        try:
            seeds += range(int(first), int(last or first) + 1)
        except ValueError as problem:
            raise ValueError(f"--seeds is {text!r}; write 1-10 or 3,5,8") from problem
    if not seeds:
        raise ValueError(f"--seeds is {text!r}, which names none: the smaller one comes first")
    return seeds
