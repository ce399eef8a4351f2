"""Whether what the robot touches was in its map, for long enough to stop before it."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from math import tau

import numpy as np

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.tiles import NO_ROW
from onemap_shared.geometry import F64, U8, Bool
from onemap_shared.grid import world_cells
from onemap_shared.messages import Occupancy
from onemap_simulator.physics.collision import CollisionMap

LOOKS_S = 0.5  # between two looks at the map
SHOWN_S = 2.5  # before the contact: a plan is made and checked again, and the robot stands
TOUCH_M, BESIDE_M = 0.02, 0.05  # between disc and obstacle; obstacle and its cell in the map
DIRECTIONS = 64


@dataclass(frozen=True, slots=True)
class _Look:
    at_s: float
    belief: BeliefMap
    states: U8  # of the cells, by their rows


@dataclass(slots=True)
class ShownObstacles:
    """What the map showed lately, so that it can be said of a contact."""

    collision: CollisionMap
    radius_m: float
    _looks: deque[_Look] = field(default_factory=deque)  # oldest first

    def look(self, belief: BeliefMap, now_s: float) -> None:
        """Keep what this map shows now."""
        if self._looks and now_s - self._looks[-1].at_s < LOOKS_S:
            return
        if self._looks and self._looks[-1].belief is not belief:  # begun anew, or loaded
            self._looks.clear()
        self._looks.append(_Look(now_s, belief, belief.occupancy.states.values.copy()))
        while len(self._looks) > 2 and self._looks[1].at_s < now_s - SHOWN_S:
            self._looks.popleft()

    def forget(self) -> None:
        """There is no map."""
        self._looks.clear()

    def shown_at(self, x_m: float, y_m: float, now_s: float) -> tuple[float, float] | None:
        """Where the disc, centred here, touches what every map of the last ``SHOWN_S`` showed."""
        if not self._looks or self._looks[0].at_s > now_s - SHOWN_S:
            return None
        for point in self._touched(x_m, y_m):
            if all(_occupied(look, point) for look in self._looks):
                return float(point[0]), float(point[1])
        return None

    def _touched(self, x_m: float, y_m: float) -> F64:
        """Places (n, 2) of obstacles at the edge of the disc."""
        angles = np.linspace(0.0, tau, DIRECTIONS, endpoint=False)
        edge = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        places: F64 = (x_m, y_m) + (self.radius_m + TOUCH_M) * edge
        near = [self.collision.clearance_m(*place) <= TOUCH_M for place in places.tolist()]
        return places[near]


def _occupied(look: _Look, place: F64) -> bool:
    """Whether the map shows an obstacle at this place (2,), or beside it."""
    size_m = look.belief.params.cell_size_m
    around = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)]) * BESIDE_M
    rows = look.belief.tiles.rows(world_cells(place + around, size_m))
    rows = rows[(rows != NO_ROW) & (rows < len(look.states))]
    occupied: Bool = look.states[rows] == Occupancy.OCCUPIED
    return bool(occupied.any())
