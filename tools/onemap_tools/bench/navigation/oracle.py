"""The oracle: knows the apartment and drives the shortest path to each object; SPL is 1."""

from __future__ import annotations

import numpy as np

from onemap_shared.messages import SearchState
from onemap_simulator.ground_truth.truth import SceneTruth
from onemap_tools.bench.navigation.episodes import NavigationEpisode
from onemap_tools.bench.navigation.records import Failure, ObjectRecord

POINT_EVERY = 4  # cells of 5 cm between two points of the trajectory


def oracle_objects(
    truth: SceneTruth, episode: NavigationEpisode, speed_mps: float
) -> tuple[tuple[ObjectRecord, ...], tuple[tuple[float, float], ...]]:
    """The records of all objects and the positions on the way, driven at the highest speed."""
    here, records, trajectory = episode.start[:2], [], [episode.start[:2]]
    for name in episode.objects:
        length_m = truth.distances(name, *here).path_m
        path = truth.shortest_path(name, *here)
        reached = bool(np.isfinite(length_m))
        if reached:
            trajectory += [(float(x), float(y)) for x, y in (*path[::POINT_EVERY], path[-1])]
            here = trajectory[-1]
        records.append(_record(name, length_m if reached else None, speed_mps))
    return tuple(records), tuple(trajectory)


def _record(name: str, length_m: float | None, speed_mps: float) -> ObjectRecord:
    reached, driven_m = length_m is not None, length_m or 0.0
    return ObjectRecord(
        name=name,
        outcome=(SearchState.FOUND if reached else SearchState.NOT_FOUND).value,
        reason="the shortest path" if reached else "no path leads there",
        success=reached,
        claimed_wrongly=False,
        spl=float(reached),
        path_length_m=driven_m,
        shortest_path_m=length_m,
        goal_distance_m=0.0 if reached else None,
        time_s=driven_m / speed_mps,
        in_view=0,
        detected=0,
        failure=Failure.NONE if reached else Failure.NEVER_IN_VIEW,
    )
