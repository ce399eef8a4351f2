"""Rooms of generated apartments, cut from maps of a tour, against the floor plans."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from statistics import mean
from typing import Any

import numpy as np
import torch

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_mapper.places.rooms import Rooms, rooms_of
from onemap_mapper.query.replies import search_view
from onemap_mapper.query.scores import MapScores
from onemap_shared.geometry import F64, U16, Bool
from onemap_shared.messages import NO_ROOM, FeatureField, Occupancy, SearchView
from onemap_simulator.errors import STEREO, DepthErrorParams
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, RgbdCamera
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.frames import FRAME_NS
from onemap_tools.bench.options import RoomsBench
from onemap_tools.bench.scene import tour_poses

SEEDS = range(800, 900)  # as bench queries: odd ones to choose constants by
MORE_FRAMES = 20  # in which no room may be lost
MIN_SEEN_M2 = 1.0  # of a room's floor: with less it was not visited
DEPTH = {"exact": DepthErrorParams(), "stereo": STEREO}


@dataclass(frozen=True, slots=True)
class Tour:
    """The rooms after a tour: ``lost`` of those 20 frames before are neither there nor told."""

    ious: tuple[float, ...]
    rooms: int
    lost: int


def run(options: RoomsBench, tell: Callable[[str], None]) -> dict[str, Any]:
    """IoU of each true room with the best of those found, over free cells, with each depth."""
    torch.set_num_threads(options.threads)
    wanted = {"all": (0, 1), "even": (0,), "odd": (1,)}[options.parity]
    seeds = [seed for seed in SEEDS if seed % 2 in wanted][: options.apartments]
    results = []
    for depth, errors in DEPTH.items():
        tours = []
        for seed in seeds:
            tours.append(tour(seed, errors, options.places))
            tell(f"{depth} depth, apartment {seed}: {mean(tours[-1].ious):.3f}")
        results.append(
            {
                "depth": depth,
                "apartments": len(tours),
                "mean_iou": round(mean(iou for each in tours for iou in each.ious), 3),
                "worst_apartment": round(min(mean(each.ious) for each in tours), 3),
                "true_rooms": sum(len(each.ious) for each in tours),
                "rooms": sum(each.rooms for each in tours),
                "lost": sum(each.lost for each in tours),
            }
        )
    return {"benchmark": "rooms", "seeds": seeds, "results": results}


def tour(seed: int, errors: DepthErrorParams, places: int) -> Tour:
    """Map an apartment and compare its rooms with the floor plan."""
    scene, camera = generate_apartment(seed), CameraParams(width=160, height=120)
    poses = tour_poses(scene, camera, places)
    device = RgbdCamera(scene, Renderer(scene), camera, np.random.default_rng(seed), errors)
    belief = BeliefMap(MapParams())
    for index, pose in enumerate(poses):
        depth_mm = device.capture(pose @ np.linalg.inv(camera.mount)).depth_mm
        belief.fuse(compute_update(featureless(index, depth_mm, camera, pose), belief.params))
        if index == len(poses) - 1 - MORE_FRAMES:
            before = rooms_of(view_of(belief))
    view = view_of(belief)
    found = rooms_of(view, before)
    told = {room for change in found.changes for room in change.before}
    overlaps = tuple(ious(found, view.occupancy == Occupancy.FREE, scene))
    return Tour(overlaps, len(found.present), len(before.present - found.present - told))


def featureless(index: int, depth_mm: U16, camera: CameraParams, pose: F64) -> FeatureField:
    """A frame of which only the depth means anything."""
    return FeatureField(
        sequence=index,
        stamp_ns=(index + 1) * FRAME_NS,
        encoder_id="none",
        text_space="none",
        features=np.ones((1, 1, 1), np.float16),
        variance=np.ones(depth_mm.shape, np.float32),
        depth_mm=depth_mm,
        intrinsics=camera.intrinsics,
        T_map_camera=pose,
    )


def view_of(belief: BeliefMap) -> SearchView:
    """The layers of the map."""
    return search_view(MapScores(belief).of([]), text="")


def ious(found: Rooms, free: Bool, scene: Scene) -> Iterator[float]:
    """Of each true room: its free cells and those of the best room found, within all true rooms."""
    grid, ids = found.grid, found.ids
    centres = grid.centres(np.argwhere(np.ones(grid.shape, bool))).reshape(*grid.shape, 2)
    bounds = [np.reshape(room.bounds_m, (2, 2)) for room in scene.rooms]
    masks = [free & ((centres > low) & (centres < high)).all(axis=2) for low, high in bounds]
    inside = np.logical_or.reduce(masks)
    for mask in masks:
        if mask.sum() * grid.cell_size_m**2 >= MIN_SEEN_M2:
            parts = [(ids == room) & inside for room in {*ids[mask].tolist()} - {NO_ROOM}]
            yield max(((mask & part).sum() / (mask | part).sum() for part in parts), default=0.0)
