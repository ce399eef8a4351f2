"""What a robot's search gains from a map into which another robot's frames were fused.

In simulated time, with the modules of the services: one robot searches for two objects; then a
second one, from a place of its own, searches for a third, once on a map of its own and once on the
map of the first.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace

from onemap_mapper.belief.map import BeliefMap
from onemap_shared.messages import SearchState, TruthRequest
from onemap_simulator.ground_truth.truth import SceneTruth, truth_reply
from onemap_simulator.rendering.label_renderer import LabelRenderer
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.lockstep import LockstepSimulation
from onemap_tools.bench.navigation.choices import Features
from onemap_tools.bench.navigation.episode_run import (
    EpisodeSetup,
    drawn_episode,
    not_sought,
    perception,
    system_config,
)
from onemap_tools.bench.navigation.episodes import NavigationEpisode
from onemap_tools.bench.simulated_robot import SimulatedRobot
from onemap_tools.demo.summary import ObjectSummary
from onemap_tools.demo.truth import evaluate_result

SECOND = 1  # the second robot's number in the map of the first
FIRST_OBJECTS = 2


@dataclass(frozen=True, slots=True)
class SecondSearch:
    """How the second robot's search ended: whether at the object, and what way it took."""

    success: bool
    path_m: float
    time_s: float


@dataclass(frozen=True, slots=True)
class SharedMapRow:
    """One apartment. first: what the first robot sought, name: what the second one did."""

    seed: int
    first: tuple[str, ...]
    name: str
    shortest_m: float
    alone: SecondSearch
    shared: SecondSearch


def run(
    setups: Iterable[EpisodeSetup], report: Callable[[SharedMapRow], None]
) -> dict[str, object]:
    """Measure every setup; ``objects`` of a setup has no meaning here."""
    rows = []
    for setup in setups:
        rows.append(row_of(setup))
        report(rows[-1])
    return {"benchmark": "shared map", "rows": [asdict(row) for row in rows]} | summarise(rows)


def row_of(setup: EpisodeSetup) -> SharedMapRow:
    """The apartment of one setup. ValueError if it has too few objects that can be reached."""
    scene, truth, first = drawn_episode(replace(setup, objects=FIRST_OBJECTS))
    _, _, second = drawn_episode(replace(setup, objects=1))
    before = _simulation(scene, first, setup)
    before.search(first.objects, setup.limit_s * FIRST_OBJECTS)
    (name,) = second.objects
    return SharedMapRow(
        seed=first.seed,
        first=first.objects,
        name=name,
        shortest_m=truth.distances(name, *second.start[:2]).path_m,
        alone=_second_search(scene, truth, second, setup, None),
        shared=_second_search(scene, truth, second, setup, before.belief),
    )


def summarise(rows: Sequence[SharedMapRow]) -> dict[str, object]:
    """Successes, and the sums of ways and times where both searches succeeded."""
    both = [row for row in rows if row.alone.success and row.shared.success]
    numbers: dict[str, object] = {
        "apartments": len(rows),
        "found_alone": sum(row.alone.success for row in rows),
        "found_shared": sum(row.shared.success for row in rows),
        "found_both": len(both),
    }
    if both:
        numbers |= {
            "shortest_m": round(sum(row.shortest_m for row in both), 1),
            "path_alone_m": round(sum(row.alone.path_m for row in both), 1),
            "path_shared_m": round(sum(row.shared.path_m for row in both), 1),
            "time_alone_s": round(sum(row.alone.time_s for row in both), 1),
            "time_shared_s": round(sum(row.shared.time_s for row in both), 1),
            "median_path_ratio": round(
                statistics.median(row.shared.path_m / max(row.alone.path_m, 0.1) for row in both),
                2,
            ),
        }
    return numbers


def row_line(row: SharedMapRow) -> str:
    """One apartment in a line."""
    ends = "  ".join(
        f"{kind} {'found' if end.success else 'not found'} {end.path_m:.1f} m {end.time_s:.0f} s"
        for kind, end in (("alone", row.alone), ("shared", row.shared))
    )
    return f"seed {row.seed}: {row.name} ({row.shortest_m:.1f} m away)  {ends}"


def _second_search(
    scene: Scene,
    truth: SceneTruth,
    episode: NavigationEpisode,
    setup: EpisodeSetup,
    belief: BeliefMap | None,
) -> SecondSearch:
    simulation = _simulation(scene, episode, setup)
    if belief is not None:
        simulation.share(belief, SECOND)
    search = simulation.search(episode.objects, setup.limit_s)
    (name,) = episode.objects
    result = search.results[0] if search.results else not_sought(name)
    judged: ObjectSummary = evaluate_result(
        asdict(result),
        name,
        lambda name, place: truth_reply(truth, TruthRequest(name, *place[:2])),
    )
    found = judged.success and result.outcome is SearchState.FOUND
    return SecondSearch(found, judged.path_length_m, judged.time_s)


def _simulation(
    scene: Scene, episode: NavigationEpisode, setup: EpisodeSetup
) -> LockstepSimulation:
    """A robot at the episode's start, with a perception and a map of its own."""
    config = system_config(setup)
    labels = None if setup.features is Features.MINI else LabelRenderer(scene)
    robot = SimulatedRobot(replace(scene, start=episode.start), config.simulator, labels)
    return LockstepSimulation(robot, config, perception(scene, setup, config))
