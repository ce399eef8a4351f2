"""An episode's trajectory over the floor plan of its apartment."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64, U8
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from onemap_simulator.inspection import FloorMap
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import RobotParams
from onemap_tools.bench.navigation.records import EpisodeRecord
from onemap_tools.cli.floor_plan import draw_floor_plan, draw_path

COLOURS = ((200, 90, 0), (60, 150, 20), (0, 120, 240))  # BGR: blue, green, orange
STAIRWELL = (0, 0, 220)  # red


def episode_picture(episode: EpisodeRecord, style: str, robot: RobotParams) -> U8:
    """A BGR image (rows, columns, 3): the floor plan, stairwells, and each object's path."""
    scene = generate_apartment(episode.seed, STYLES[style])
    collision = CollisionMap.of(scene, robot.height_m)
    reachable = collision.reachable_cells(*episode.start[:2], robot.radius_m)
    floor = FloorMap(collision.grid, collision.clearance <= 0, reachable)
    image = draw_floor_plan(scene, floor, episode.start)
    for x0, y0, x1, y1 in episode.stairwells:
        corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)])
        image = draw_path(image, floor.grid, corners, STAIRWELL)
    for index, path in enumerate(paths_of(episode)):
        image = draw_path(image, floor.grid, path, COLOURS[index % len(COLOURS)])
    return image


def paths_of(episode: EpisodeRecord) -> list[F64]:
    """The trajectory (N, 2) cut into the paths to each object, by the time that each took."""
    points = np.array(episode.trajectory, np.float64).reshape(-1, 2)
    times_s = np.cumsum([item.time_s for item in episode.objects])
    if len(points) == 0 or times_s[-1] <= 0:
        return []
    ends = np.rint(times_s / times_s[-1] * (len(points) - 1)).astype(int)
    starts = np.append(0, ends[:-1])
    return [points[a : b + 1] for a, b in zip(starts, ends, strict=True)]
