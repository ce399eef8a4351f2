"""Ground truth of the simulator, for the summaries of demos and benchmarks."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TruthRequest:
    """Simulator only: request for the true distance of a point to the nearest such object.

    Attributes:
        name: category of the object.
        x_m: of the point, in the map frame.
        y_m: of the point, in the map frame.
    """

    name: str
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True)
class Truth:
    """Ground truth for the summary of a demo; never read by perception, mapper or planner.

    Attributes:
        scene: name of the scene.
        instances: number of such objects.
        distance_m: straight line from the point to the surface of the nearest; infinity if there
            is none.
        shortest_path_m: along the floor for this robot to the nearest point that counts as
            success, 0 if the point itself does; infinity if there is none.
        categories: every category of the scene.
        nearest: category of the object nearest to the point, without walls, floors, ceilings,
            doors and windows; empty if there is none or it has no name.
        names_complete: whether every object of the scene has a name. If not, an object whose
            name is not among the categories may still be there, and a search for it cannot be
            evaluated.
    """

    scene: str
    instances: int
    distance_m: float
    shortest_path_m: float
    categories: tuple[str, ...]
    nearest: str
    names_complete: bool
