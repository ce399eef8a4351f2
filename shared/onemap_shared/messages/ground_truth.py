"""Ground truth of the simulator, for the summaries of demos and benchmarks."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TruthRequest:
    """Simulator only: how far is the nearest object of this name from a place, really?"""

    name: str
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True)
class Truth:
    """Ground truth for the summary of a demo; never read by perception, mapper or planner.

    instances: how many there are; distance_m: straight line from the place to the surface
    of the nearest; shortest_path_m: along the floor for this robot to the nearest place that
    counts as success, 0 if the place itself does; infinity if there is none. nearest: category
    of the thing nearest to the place, walls, floors, ceilings, doors and windows left out;
    empty if there is none or nobody named it.
    names_complete: whether nothing in the scene lacks its name. If not, a name that is not
    among the categories may still be there: nobody can judge a search for it.
    """

    scene: str
    instances: int
    distance_m: float
    shortest_path_m: float
    categories: tuple[str, ...]
    nearest: str
    names_complete: bool
