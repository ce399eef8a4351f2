"""Time of a planning step in drawn buildings of several sizes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import ndimage

from onemap_planner.config import PlannerConfig
from onemap_planner.motion.motions import Drive, Pose2d
from onemap_planner.policy.memory import PlannerState
from onemap_planner.policy.outcome import Decision, Observation
from onemap_planner.policy.step import step
from onemap_planner.search.phases import EventStamp, Exploring
from onemap_planner.search.state_machine import new_search
from onemap_shared.geometry import Bool, Velocity2d
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Layer, Occupancy, SearchView
from onemap_tools.bench.machine import machine_facts, spread_ms
from onemap_tools.bench.options import PlanningBench

CELL_M = 0.1  # as the mapper has it by default
ROOM_CELLS = 50  # 5 m
DOOR_CELLS = 10
SEEN_SHARE = 0.6  # of the rooms; the others are frontiers to choose from
WARM_UP = 3  # steps that are not counted: first imports and allocations
SEED = 0
SIZES_M = (10, 20, 30, 50)
SPEED_MPS = 0.4  # at which the robot follows its path


def run(options: PlanningBench, _tell: Callable[[str], None]) -> dict[str, Any]:
    """Plan in a building of each size; processor time in milliseconds."""
    rows = [_time_steps(size_m, options.steps) for size_m in options.size or SIZES_M]
    return {"benchmark": "planning", "steps": options.steps, "results": rows, **machine_facts()}


def _time_steps(size_m: int, steps: int) -> dict[str, Any]:
    params = PlannerConfig()
    view = building_view(size_m, np.random.default_rng(SEED))
    middle_m = (view.grid.shape[0] // 2 // ROOM_CELLS + 0.5) * ROOM_CELLS * CELL_M
    pose = Pose2d(middle_m, middle_m, 0.0)  # in a room in the middle of the building
    search = new_search("benchmark", (view.text,), EventStamp(0.0, 0.0, pose.xy, 0.0), 0)
    state = PlannerState(replace(search, phase=Exploring()))
    times_ms = []
    for index in range(steps + WARM_UP):
        observation = Observation(
            now_s=index / params.plan_hz,
            pose=pose,
            odometer_m=0.0,
            command=Velocity2d(0.0, 0.0),
            collided=False,
            view=replace(view, sequence=index),
            detections=(),
            stale_reason="",
        )
        started = time.process_time()
        outcome = step(state, observation, params)
        state, decision = outcome.state, outcome.decision
        times_ms.append((time.process_time() - started) * 1e3)
        pose = _moved(pose, decision, SPEED_MPS / params.plan_hz)
    counted = times_ms[WARM_UP:]
    facts = {"size_m": size_m, "known_m2": round(state.known_m2)}
    return {**facts, **spread_ms(counted, "cpu_"), "cpu_mean_ms": round(float(np.mean(counted)), 3)}


def building_view(size_m: int, rng: np.random.Generator) -> SearchView:
    """A square building of rooms of 5 m with doors to all sides, seen in part.

    The rooms around the middle are seen; similarity is smooth noise with a few peaks.
    """
    cells = round(size_m / CELL_M)
    seen = _seen(cells, rng)
    along = np.arange(cells) % ROOM_CELLS
    wall, door = along == 0, np.abs(along - ROOM_CELLS // 2) <= DOOR_CELLS // 2
    walls = (wall[:, None] & ~door) | (wall & ~door[:, None])
    occupancy = np.where(walls, Occupancy.OCCUPIED, Occupancy.FREE).astype(np.uint8)
    occupancy[~seen] = Occupancy.UNKNOWN
    noise = ndimage.gaussian_filter(rng.standard_normal((cells, cells)), 5)
    explored = seen & (ndimage.gaussian_filter(rng.standard_normal((cells, cells)), 10) > -0.02)
    layers = seen * int(Layer.OBSERVED) | explored * int(Layer.EXPLORED)
    similarity = np.clip(noise / noise.max(), 0.0, 1.0) ** 4
    rank = noise.ravel().argsort().argsort().reshape(cells, cells) / cells**2
    return SearchView(
        text="bed",
        revision=0,
        sequence=0,
        stamp_ns=1,
        grid=GridSpec(CELL_M, (0, 0), (cells, cells)),
        occupancy=occupancy,
        layers=layers.astype(np.uint8),
        similarity=np.where(seen, similarity, np.nan).astype(np.float32),
        guidance=np.where(seen, 1 + 254 * rank, 0).astype(np.uint8),
    )


def _seen(cells: int, rng: np.random.Generator) -> Bool:
    room = np.arange(cells) // ROOM_CELLS
    rooms = rng.random((room[-1] + 1, room[-1] + 1)) < SEEN_SHARE
    middle = room[cells // 2]
    rooms[middle], rooms[:, middle] = True, True
    seen: Bool = rooms[room[:, None], room]
    return seen


def _moved(pose: Pose2d, decision: Decision | None, distance_m: float) -> Pose2d:
    """The pose after ``distance_m`` along the path of the decision, if it has one."""
    if decision is None or not isinstance(decision.motion, Drive):
        return pose
    points = decision.motion.points_xy
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    x, y = (float(np.interp(distance_m, along, points[:, axis])) for axis in (0, 1))
    return Pose2d(x, y, float(np.arctan2(y - pose.y_m, x - pose.x_m)))
