"""Occupancy from depth: where the robot may drive.

Each cell is a column of voxels over the heights the robot's body passes through. A point
marks its voxel; a ray that passes through a voxel and ends behind it speaks against it. So
a ray over a coffee table says nothing about the table, and the floor seen under a table
does not free it. A cell is free once its floor, or the space just above the floor, was
seen and no voxel of its column is occupied.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onemap_shared.geometry import F32, F64, I64, U8, Bool, Intrinsics, transform, unproject
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy

I8 = NDArray[np.int8]

# Evidence is a log-odds in steps of about 0.4, an int8 per voxel.
HIT = 4  # two or more points: occupied at once where nothing was known
GLIMPSE = 1  # one point: a thin leg far away, or a stray pixel; alone it only stops clearing
MISS = 1  # four frames clear what was seen once, twelve what was seen often
MOST, LEAST = 12, -4  # bounded, so that what moved away disappears and what comes appears
OCCUPIED_FROM = 3
MIN_HITS = 2
RAY_STRIDE = 4  # of the thinned image: rays 0.1 m apart at the clearing range
RAY_STEP = 0.7  # cells between samples: crossing a mere corner does not clear a voxel


@dataclass(frozen=True, slots=True)
class OccupancySettings:
    """Heights above the floor and ranges from the camera, in metres."""

    cell_size_m: float
    floor_tolerance_m: float
    min_height_m: float
    max_height_m: float
    low_height_m: float
    height_error_per_m: float
    max_range_m: float
    clear_range_m: float
    max_image_rows: int

    @property
    def levels(self) -> int:
        """Voxels per column, as high as a cell is wide."""
        return max(1, round((self.max_height_m - self.min_height_m) / self.cell_size_m))


@dataclass(frozen=True, slots=True)
class OccupancyFrame:
    """What one frame says of the cells it touches.

    cells (n, 2) int64 world cells; evidence (n, levels) int8 to add; clear (n,) bool: the
    floor or the space just above it was seen.
    """

    cells: I64
    evidence: I8
    clear: Bool


def thinned(depth_m: F32, intrinsics: Intrinsics, max_rows: int) -> tuple[F32, Intrinsics]:
    """Every n-th pixel, without averaging, and the camera of that image."""
    n = -(-depth_m.shape[0] // max_rows)
    cx, cy = ((centre - 0.5) / n + 0.5 for centre in (intrinsics.cx, intrinsics.cy))
    return depth_m[::n, ::n], Intrinsics(intrinsics.fx / n, intrinsics.fy / n, cx, cy)


def observe(
    depth_m: F32, *, intrinsics: Intrinsics, T_map_camera: F64, settings: OccupancySettings
) -> OccupancyFrame:
    """Evidence of one depth image (H, W) float32 metres, 0 = none, with the full pose."""
    depth_m, intrinsics = thinned(depth_m, intrinsics, settings.max_image_rows)
    points = transform(T_map_camera, unproject(depth_m, intrinsics).astype(np.float64))
    camera = T_map_camera[:3, 3]
    rays = points[::RAY_STRIDE, ::RAY_STRIDE][depth_m[::RAY_STRIDE, ::RAY_STRIDE] > 0]
    usable = (depth_m > 0) & (depth_m <= settings.max_range_m)
    points, depth = points[usable], depth_m[usable]
    samples = ray_samples(camera, rays, settings=settings)
    everything = np.concatenate([points[:, :2], samples[:, :2], camera[None, :2]])
    box = GridSpec.covering(
        settings.cell_size_m,
        tuple(everything.min(axis=0).tolist()),
        tuple(everything.max(axis=0).tolist()),
    )
    slack = settings.height_error_per_m * depth
    is_floor = np.abs(points[:, 2]) <= settings.floor_tolerance_m + slack
    is_obstacle = points[:, 2] >= settings.min_height_m + slack
    hits = voxel_counts(points[is_obstacle], box, settings)
    crossed = voxel_counts(samples, box, settings) > 0
    low = samples[:, 2] < settings.low_height_m
    clear = cell_mask(points[is_floor], box) | cell_mask(samples[low], box)
    evidence = np.where(hits >= MIN_HITS, HIT, np.where(hits > 0, GLIMPSE, -MISS * crossed))
    touched = clear | evidence.any(axis=2)
    cells = np.argwhere(touched) + np.asarray(box.origin_cell)
    return OccupancyFrame(cells, evidence[touched].astype(np.int8), clear[touched])


def ray_samples(camera: F64, ends: F64, *, settings: OccupancySettings) -> F64:
    """Points (n, 3) in the empty space between camera (3,) and surface points (m, 3).

    Only within the clearing range, below the robot's height and above the floor, and not in
    the last cell before the surface, which depth noise may put on either side of a border.
    """
    step = RAY_STEP * settings.cell_size_m
    rays = ends - camera
    length = np.linalg.norm(rays, axis=1)
    ways = np.arange(step, settings.clear_range_m, step)
    rays = rays / np.maximum(length, 1e-6)[:, None]
    z = camera[2] + rays[:, 2, None] * ways
    inside = ways <= (length - settings.cell_size_m)[:, None]
    inside &= (z < settings.max_height_m) & (z > -settings.floor_tolerance_m)
    ray, way = np.nonzero(inside)
    samples: F64 = camera + rays[ray] * ways[way, None]
    return samples


def voxel_counts(points: F64, box: GridSpec, settings: OccupancySettings) -> I64:
    """How many points (n, 3) fall in each voxel (nx, ny, levels) of the box."""
    levels = settings.levels
    thickness = (settings.max_height_m - settings.min_height_m) / levels
    level = np.floor((points[:, 2] - settings.min_height_m) / thickness).astype(np.int64)
    within = (level >= 0) & (level < levels)
    cells = box.cells(points[within])
    flat = (cells[:, 0] * box.shape[1] + cells[:, 1]) * levels + level[within]
    size = box.shape[0] * box.shape[1] * levels
    return np.bincount(flat, minlength=size).reshape(*box.shape, levels)


def cell_mask(points: F64, box: GridSpec) -> Bool:
    """Which cells (nx, ny) of the box hold any of the points (n, 3)."""
    mask = np.zeros(box.shape, bool)
    mask[tuple(box.cells(points).T)] = True
    return mask


def accumulated(evidence: I8, added: I8) -> I8:
    """The bounded sum of evidence (n, levels)."""
    total: I8 = np.clip(evidence.astype(np.int16) + added, LEAST, MOST).astype(np.int8)
    return total


def states(evidence: I8, clear: Bool) -> U8:
    """Values of ``Occupancy`` (n,) uint8 from evidence (n, levels) and clear (n,)."""
    occupied = (evidence >= OCCUPIED_FROM).any(axis=1)
    state: U8 = np.where(clear, Occupancy.FREE, Occupancy.UNKNOWN).astype(np.uint8)
    state[occupied] = Occupancy.OCCUPIED
    return state


def disc(centre_m: F64, radius_m: float, cell_size_m: float) -> I64:
    """World cells (n, 2) whose centre lies within ``radius_m`` of a point (x, y, ...)."""
    x, y = float(centre_m[0]), float(centre_m[1])
    box = GridSpec.covering(cell_size_m, (x - radius_m, y - radius_m), (x + radius_m, y + radius_m))
    cells = np.argwhere(np.ones(box.shape, bool))
    inside = np.linalg.norm(box.centres(cells) - (x, y), axis=1) <= radius_m
    chosen: I64 = cells[inside] + np.asarray(box.origin_cell)
    return chosen
