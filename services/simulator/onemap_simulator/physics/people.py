"""People who walk between random free places, around the robot, and stop before it."""

from __future__ import annotations

from dataclasses import dataclass
from math import dist, hypot, inf

import numpy as np

from onemap_shared.geometry import F64, Bool
from onemap_shared.grid import GridSpec
from onemap_simulator.ground_truth.shortest_paths import ShortestPaths
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.scene.scene import Scene

Place = tuple[float, float]

CELL_SIZE_M = 0.1  # of the cells that people walk on
RADIUS_M = 0.25  # half of a person's shoulders; a person is an upright cylinder
BODY_HEIGHT_M = 1.7  # an adult's; people stoop below nothing
MAX_SPEED_MPS = 1.0  # of the fastest, a walk at home
START_AWAY_M = 1.5  # nobody starts nearer to the robot
GAP_M = 0.3  # between a person who stopped and the robot
PATIENCE_S = 3.0  # then a person who was stopped by the robot, or found no way, goes elsewhere
LEAST_SPEED = 0.5  # of the fastest: everybody walks at a pace of their own


@dataclass(frozen=True, slots=True)
class Bystanders:
    """People at places (N, 2) in metres, each a cylinder of this size that stands on the floor."""

    places: F64
    radius_m: float
    height_m: float


NOBODY = Bystanders(np.zeros((0, 2)), RADIUS_M, BODY_HEIGHT_M)


@dataclass(frozen=True, slots=True)
class WalkableFloor:
    """Cells (nx, ny) of a grid in which the centre of a person may be, all connected."""

    grid: GridSpec
    cells: Bool

    @classmethod
    def of(cls, scene: Scene, radius_m: float) -> WalkableFloor:
        """What a person of this radius can reach from the robot's start."""
        collision = CollisionMap.of(scene, BODY_HEIGHT_M, CELL_SIZE_M)
        x_m, y_m, _ = scene.start
        return cls(collision.grid, collision.reachable_cells(x_m, y_m, radius_m))

    def path(
        self, start: Place, rng: np.random.Generator, *, robot_xy: Place, gap_m: float
    ) -> tuple[Place, ...]:
        """The shortest path to a random place that keeps this gap to the robot, as cell centres.

        Who is nearer to it gets no nearer. Empty where there is no such place. The cell of the
        start is left out: its centre may be nearer to the robot by a hair, and whom the robot
        stopped could not turn away.
        """
        cells = np.argwhere(self.cells)
        if not len(cells):
            return ()
        centres = self.grid.centres(cells)
        own = tuple(cells[int(_away(centres, start).argmin())])
        begin, free = np.zeros_like(self.cells), np.zeros_like(self.cells)
        far = _away(centres, robot_xy) >= min(gap_m, dist(start, robot_xy))
        free[tuple(cells[far].T)] = True
        begin[own] = free[own] = True
        paths = ShortestPaths.to(begin, free)
        goals = paths.cells[np.isfinite(paths.lengths)]
        back = self.grid.centres(paths.cells_from(goals[int(rng.integers(len(goals)))]))
        return tuple((float(x), float(y)) for x, y in back[-2::-1])


@dataclass(slots=True)
class Walker:
    """One person: where they are, how fast, and the rest of their path.

    waited_s: for how long the robot has stopped them. rest_s: until they look for a path again.
    """

    place: Place
    speed_mps: float
    path: tuple[Place, ...] = ()
    waited_s: float = 0.0
    rest_s: float = 0.0


class People:
    """All people. They keep off obstacles and the robot, but not off one another."""

    def __init__(
        self,
        floor: WalkableFloor,
        count: int,
        rng: np.random.Generator,
        *,
        robot_xy: Place,
        robot_radius_m: float,
    ) -> None:
        self._floor, self._rng = floor, rng
        self._gap_m = RADIUS_M + robot_radius_m + GAP_M
        places = floor.grid.centres(np.argwhere(floor.cells))
        places = places[_away(places, robot_xy) >= START_AWAY_M]
        count = count if len(places) else 0
        starts = rng.choice(places, count) if count else places[:0]
        speeds = MAX_SPEED_MPS * rng.uniform(LEAST_SPEED, 1.0, count)
        self._walkers = [
            Walker((float(x), float(y)), float(speed))
            for (x, y), speed in zip(starts, speeds, strict=True)
        ]

    @classmethod
    def of(
        cls, scene: Scene, count: int, rng: np.random.Generator, *, robot_radius_m: float
    ) -> People | None:
        """The people of a scene, away from the robot's start; None if there are none."""
        if count == 0:
            return None
        floor = WalkableFloor.of(scene, RADIUS_M)
        return cls(floor, count, rng, robot_xy=scene.start[:2], robot_radius_m=robot_radius_m)

    @property
    def bystanders(self) -> Bystanders:
        """Where everybody is."""
        places = np.array([walker.place for walker in self._walkers]).reshape(-1, 2)
        return Bystanders(places, RADIUS_M, BODY_HEIGHT_M)

    def distance_m(self, x_m: float, y_m: float) -> float:
        """Distance from a place to the nearest person's side, negative within; infinity: none."""
        away = (hypot(w.place[0] - x_m, w.place[1] - y_m) for w in self._walkers)
        return min(away, default=inf) - RADIUS_M

    def advance(self, dt_s: float, robot_xy: Place) -> None:
        """Walk for a few hundredths of a second, past a robot that stands at this place."""
        for walker in self._walkers:
            walker.rest_s -= dt_s
            if not walker.path and walker.rest_s <= 0:
                walker.path = self._floor.path(
                    walker.place, self._rng, robot_xy=robot_xy, gap_m=self._gap_m
                )
                walker.waited_s, walker.rest_s = 0.0, PATIENCE_S
            if walker.path:
                self._walk(walker, dt_s, robot_xy)

    def _walk(self, walker: Walker, dt_s: float, robot_xy: Place) -> None:
        (x, y), (goal_x, goal_y) = walker.place, walker.path[0]
        left_m, step_m = hypot(goal_x - x, goal_y - y), walker.speed_mps * dt_s
        share = 1.0 if left_m <= step_m else step_m / left_m
        place = (x + share * (goal_x - x), y + share * (goal_y - y))
        now_m = hypot(x - robot_xy[0], y - robot_xy[1])
        then_m = hypot(place[0] - robot_xy[0], place[1] - robot_xy[1])
        if then_m < min(now_m, self._gap_m):
            walker.waited_s += dt_s
            if walker.waited_s > PATIENCE_S:
                walker.path = ()
            return
        walker.place, walker.waited_s = place, 0.0
        if share == 1.0:
            walker.path = walker.path[1:]


def _away(places: F64, place: Place) -> F64:
    """Distances (N,) of places (N, 2) from a place."""
    away: F64 = np.hypot(places[:, 0] - place[0], places[:, 1] - place[1])
    return away
