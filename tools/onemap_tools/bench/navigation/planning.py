"""Time of planning steps in a drawn building, without a mapper and without a simulator."""

from __future__ import annotations

import time
from dataclasses import replace
from math import atan2
from typing import Any

import numpy as np

from onemap_planner.motion.motions import Drive, Motion, Pose2d
from onemap_planner.policy.outcome import Observation
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.step import step
from onemap_planner.search.state_machine import EventStamp, Exploring, new_search
from onemap_shared.geometry import I64, Velocity2d
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Layer, Occupancy, SearchView
from onemap_tools.bench.machine import machine_facts

CELL_M = 0.1
ROOM, DOOR = 50, 9  # cells from wall to wall, and of a door
UNSEEN, FAR, SIMILAR = 0.25, 0.15, 0.5  # of the rooms: not seen, from afar, with the like
PERIOD_S, SPEED_MPS = 0.4, 0.5  # of planning, and of the robot
STEPS = 200
SIGHT = 20  # cells around the robot that it sees
SEEN = Layer.OBSERVED | Layer.EXPLORED
PARAMS = PlannerParams()


def planning_times(side_m: float, seed: int, steps: int = STEPS) -> dict[str, Any]:
    """Milliseconds of processor time, p50 and p95: of steps, and of those that compare goals."""
    world = DrawnBuilding(round(side_m / CELL_M), np.random.default_rng(seed))
    pose, steps_ms = world.middle, dict[bool, list[float]]()
    search = new_search("bench", ("sofa",), EventStamp(0.0, 0.0, pose.xy, 0.0), 0)
    state = PlannerState(replace(search, phase=Exploring()))
    for number in range(steps):
        view, now_s = world.view(pose), PERIOD_S * number
        seen = Observation(now_s, pose, 0.0, Velocity2d(), False, view, (), "")
        began_s = time.process_time()
        outcome = step(state, seen, PARAMS)
        took_ms = 1e3 * (time.process_time() - began_s)
        state, active = outcome.state, outcome.state.active_goal
        made = active.comparison if active else None
        compared = made is None or made.at_s == state.active_time_s
        if number:  # the first meets what is not loaded yet
            steps_ms.setdefault(compared, []).append(took_ms)
        pose = moved(pose, outcome.decision.motion) if outcome.decision else pose
    comparing = steps_ms.get(True, [])
    return {
        "benchmark": "planning",
        "side_m": side_m,
        "seed": seed,
        "steps": steps - 1,
        "comparing_steps": len(comparing),
        "step_ms": spread([*comparing, *steps_ms.get(False, [])]),
        "comparing_ms": spread(comparing),
        **machine_facts(),
    }


def spread(values: list[float]) -> list[float]:
    """p50 and p95; empty of none."""
    return [round(float(q), 1) for q in np.quantile(values, (0.5, 0.95))] if values else []


class DrawnBuilding:
    """Square rooms with doors and furniture, some of them not seen yet."""

    def __init__(self, side: int, rng: np.random.Generator) -> None:
        rooms = max(side // ROOM, 1)
        grid = self._grid = GridSpec(CELL_M, (0, 0), (rooms * ROOM + 1, rooms * ROOM + 1))
        middle_m = (rooms // 2 + 0.5) * ROOM * CELL_M
        self.middle = Pose2d(middle_m, middle_m, 0.0)
        self._occupied = np.zeros(grid.shape, bool)
        self._occupied[::ROOM] = self._occupied[:, ::ROOM] = True
        self._layers = np.full(grid.shape, SEEN, np.uint8)
        self._similarity = rng.uniform(0.0, 0.12, grid.shape).astype(np.float32)
        for corner in np.argwhere(np.ones((rooms, rooms))) * ROOM:
            self._draw(corner, rng)
        free = slice(rooms // 2 * ROOM + 15, rooms // 2 * ROOM + 35)  # where the robot begins
        self._occupied[free, free] = False

    def _draw(self, corner: I64, rng: np.random.Generator) -> None:
        """A room: doors, furniture, what is like the object, and what was seen of it."""
        x, y = corner.tolist()
        along = rng.integers(5, ROOM - DOOR - 5, 2)
        self._occupied[x, y + along[0] : y + along[0] + DOOR] &= x == 0
        self._occupied[x + along[1] : x + along[1] + DOOR, y] &= y == 0
        for low in rng.integers(3, ROOM - 20, (4, 2)):
            (a, b), (c, d) = low + corner, low + corner + rng.integers(4, 16, 2)
            self._occupied[a:c, b:d] = True
        if rng.random() < SIMILAR:
            self._similarity[a:c, b:d] = rng.uniform(0.3, 0.6)
        seen, room = rng.random(), np.s_[x + 1 : x + ROOM, y + 1 : y + ROOM]
        if seen < UNSEEN + FAR:
            self._layers[room] = 0 if seen < UNSEEN else Layer.OBSERVED

    def view(self, pose: Pose2d) -> SearchView:
        """The map after the robot has looked around from here."""
        x, y = np.maximum(self._grid.cells(np.array(pose.xy)), SIGHT)
        self._layers[x - SIGHT : x + SIGHT, y - SIGHT : y + SIGHT] = SEEN
        seen = self._layers > 0
        known = np.where(self._occupied, Occupancy.OCCUPIED, Occupancy.FREE)
        occupancy = np.where(seen, known, Occupancy.UNKNOWN).astype(np.uint8)
        similarity = np.where(seen, self._similarity, np.float32(np.nan))
        ranks = np.where(seen, 1 + 254 * self._similarity, 0).astype(np.uint8)
        return SearchView(
            "sofa", 1, 1, 0, self._grid, occupancy, self._layers.copy(), similarity, guidance=ranks
        )


def moved(pose: Pose2d, motion: Motion) -> Pose2d:
    """The pose a period later, on the way and facing what is to be seen at its end."""
    if not isinstance(motion, Drive):
        return pose
    steps_m = np.hypot(*np.diff(motion.points_xy, axis=0).T)
    way_m = np.cumsum([0.0, *steps_m.tolist()])
    x, y = (float(np.interp(PERIOD_S * SPEED_MPS, way_m, axis)) for axis in motion.points_xy.T)
    return Pose2d(x, y, atan2(motion.look_xy[1] - y, motion.look_xy[0] - x))
