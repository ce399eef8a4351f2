"""What the robot claims to have found, and what really stands there: ``onemap bench claims``.

One search per seed in a generated apartment, in simulated time, for the same objects, those
that the apartment does not hold included. Every claim is judged by the simulator's truth; of a
wrong one it says what stands nearest to the claimed place.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from multiprocessing import get_context
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
from onemap_simulator.ground_truth.truth import SceneTruth, truth_reply
from onemap_tools.bench.lockstep import LockstepSimulation, PerceptionPipeline, SystemConfig
from onemap_tools.bench.parser import Parser
from onemap_tools.demo.summary import ObjectSummary
from onemap_tools.demo.truth import evaluate_result, scene_category

# Large things that most apartments have, and one, the bookcase, that some do not.
OBJECTS = ("bed", "sofa", "television", "refrigerator", "toilet", "bookcase")


@dataclass(frozen=True, slots=True)
class EpisodeParams:
    """One search: its settings, seed included, its objects, and simulated seconds at most."""

    settings: SystemConfig
    objects: tuple[str, ...]
    limit_s: float


@dataclass(frozen=True, slots=True)
class EpisodeResult:
    """What became of a task. present: for each object, whether the apartment holds one."""

    seed: int
    objects: tuple[ObjectSummary, ...]
    present: tuple[bool, ...]
    simulated_s: float
    wall_s: float

    def document(self) -> dict[str, Any]:
        """As JSON can carry it."""
        pairs = zip(self.objects, self.present, strict=True)
        objects = [{**item.document(), "present": present} for item, present in pairs]
        times = {"simulated_s": round(self.simulated_s, 1), "wall_s": round(self.wall_s, 1)}
        return {"seed": self.seed, "objects": objects, **times}


def run(task: EpisodeParams) -> EpisodeResult:
    """Search, judge, and return what happened."""
    torch.set_num_threads(1)
    began_s = time.perf_counter()
    simulator = task.settings.simulator
    scene = generate_apartment(simulator.seed, STYLES[simulator.style])
    lockstep = LockstepSimulation(
        scene, task.settings, PerceptionPipeline(task.settings.perception)
    )
    search = lockstep.search(task.objects, task.limit_s)
    truth = SceneTruth(
        scene,
        radius_m=simulator.robot.radius_m,
        height_m=simulator.robot.height_m,
        eye_height_m=simulator.camera.height_m,
    )
    vocabulary = load_vocabulary(SHIPPED)
    names = [scene_category(word, scene.categories, vocabulary) for word in task.objects]
    results = [*search.results, *(timed_out_result(w) for w in task.objects[len(search.results) :])]
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
        simulated_s=lockstep.now_s,
        wall_s=time.perf_counter() - began_s,
    )


def timed_out_result(name: str) -> ObjectResult:
    """The result of an object that the time did not suffice for."""
    return ObjectResult(name, SearchState.NOT_FOUND, "the time was over", (), 0.0, 0.0, 0.0, (), ())


def summarise(episodes: Sequence[EpisodeResult], objects: Sequence[str]) -> dict[str, Any]:
    """Counts over all episodes. spl: mean over the objects that were there, 0 where not found."""
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
    """One episode for people."""
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


def main(arguments: list[str] | None = None) -> int:
    """``onemap bench claims``; returns the exit code."""
    parser = Parser(prog="onemap bench claims", description=__doc__)
    parser.add_argument("--seeds", default="1-10", help="1-10 or 3,5,8")
    parser.add_argument("--style", default="training", choices=("training", "held out"))
    parser.add_argument("--objects", default=",".join(OBJECTS), help="separated by commas")
    parser.add_argument("--limit", type=float, default=900.0, help="simulated seconds per search")
    parser.add_argument("--workers", type=int, default=1, help="searches at once, a core each")
    parser.add_argument("--config", type=Path, help="YAML file, for example with sensor noise")
    parser.add_argument("--json", action="store_true", help="one JSON object as the last line")
    options = parser.parse_args(arguments)
    objects = tuple(name.strip() for name in options.objects.split(","))
    tasks = [
        EpisodeParams(read_sections(options.config, seed, options.style), objects, options.limit)
        for seed in parse_seeds(options.seeds)
    ]
    episodes = []
    with ProcessPoolExecutor(options.workers, get_context("spawn")) as pool:
        for episode in pool.map(run, tasks):
            episodes.append(episode)
            print(episode_line(episode), file=sys.stderr, flush=True)
    summary = summarise(episodes, objects)
    for name in ("sought", "there", "found", "claimed_wrongly", "absent_and_not_claimed", "spl"):
        print(f"{name:24} {summary[name]}", file=sys.stderr)
    if options.json:
        print(json.dumps(summary))
    return 0
