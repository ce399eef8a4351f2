"""Occupancy of the map against the scene's geometry, after a drive with noisy depth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.occupancy.host import occupancy_update
from onemap_shared.geometry import U8, Bool
from onemap_shared.messages import Occupancy
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import TRAINING
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, measured_mm, noisy_depth
from onemap_simulator.scene.occupancy_raster import rasterise
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.exploration_tour import exploration_poses


@dataclass(frozen=True, slots=True)
class OccupancyBenchParams:
    """The apartments, and the depth's standard deviations in metres at 1 m, growing with d^2."""

    seeds: tuple[int, ...]
    noises_m: tuple[float, ...]


def run(params: OccupancyBenchParams, mapper: MapperConfig) -> Iterator[dict[str, Any]]:
    """One row for each apartment and noise."""
    for seed in params.seeds:
        scene = generate_apartment(seed, TRAINING)
        for noise_m in params.noises_m:
            belief = driven(scene, noise_m, seed, mapper)
            truth = obstacles(scene, belief)
            row = overlaps(belief.occupancy_grid(), truth)
            yield {"seed": seed, "noise_m": noise_m, **row}


def driven(scene: Scene, noise_m: float, seed: int, mapper: MapperConfig) -> BeliefMap:
    """The map's occupancy after a drive along all of the floor; it holds no features."""
    on_host = mapper.model_copy(update={"device": "cpu"})  # where ``occupancy_update`` computes
    camera, belief = CameraParams(), BeliefMap(on_host)
    renderer, rng = Renderer(scene), np.random.default_rng(seed)
    for pose in exploration_poses(scene, camera):
        view = renderer.render(pose, camera.intrinsics, width=camera.width, height=camera.height)
        depth_m = noisy_depth(view.depth_m, noise_m, rng)
        depth_mm = measured_mm(depth_m, camera.min_depth_m, camera.max_depth_m)
        cloud = PointCloud.of(
            np.divide(depth_mm, 1000, dtype=np.float32),
            intrinsics=camera.intrinsics,
            T_map_camera=pose,
        )
        update = occupancy_update(cloud, mapper)
        belief.grow(update.cells)
        belief.fuse_occupancy(update)
    return belief


def obstacles(scene: Scene, belief: BeliefMap) -> Bool:
    """Cells (nx, ny) of the map's grid that geometry touches at the heights of its obstacles."""
    triangles = scene.vertices[scene.faces].astype(np.float64)
    params = belief.params
    heights = (params.obstacle_min_height_m, params.obstacle_max_height_m)
    return rasterise(triangles, belief.grid, heights)


def overlaps(occupancy: U8, obstacle: Bool) -> dict[str, float]:
    """Intersection over union of free and of occupied cells, among the cells that are known.

    Occupied cells beside an obstacle count as neither right nor wrong: a surface on the border of
    two cells belongs to both. ``false_occupied`` and ``false_free``: shares of those that are not.
    """
    beside = ndimage.binary_dilation(obstacle, np.ones((3, 3))) & ~obstacle
    known = (occupancy != Occupancy.UNKNOWN) & ~(beside & (occupancy == Occupancy.OCCUPIED))
    free, occupied = occupancy == Occupancy.FREE, known & (occupancy == Occupancy.OCCUPIED)
    clear = known & ~obstacle
    blocked = known & obstacle
    return {
        "known_cells": int(known.sum()),
        "iou_free": _share(free & clear, free | clear),
        "iou_occupied": _share(occupied & blocked, occupied | blocked),
        "false_occupied": _share(occupied & clear, occupied),
        "false_free": _share(free & blocked, free),
    }


def _share(part: Bool, whole: Bool) -> float:
    return round(float(part.sum()) / max(int(whole.sum()), 1), 3)
