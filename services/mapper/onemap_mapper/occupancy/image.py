"""The evidence of one depth image for free and occupied cells.

Flying pixels are left out: stereo and time-of-flight cameras average both surfaces in a pixel at an
edge, and as obstacles such points close doors. A pixel of a surface has neighbours at about its
depth, whichever way the surface slants: along the edge, or along the horizontal where floor is seen
at a flat angle.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.occupancy.evidence import (
    OccupancyUpdate,
    evidence_of,
)
from onemap_mapper.occupancy.floor import (
    FLOOR_TOLERANCE_M,
    HEIGHT_ERROR_PER_M,
    NO_DROP_RANGE_M,
    floor_points,
)
from onemap_mapper.params import OBSTACLE_MIN_HEIGHT_M, MapParams
from onemap_shared.geometry import F32, I32, U8, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.jit import compiled

EXACT_HEIGHT_M = 2.0  # nearer heights need no slack: an error of 1 degree is 35 mm there
RAY_STRIDE = 4  # of the thinned image: rays 0.1 m apart at the clearing range
RAY_STEP = 1.0  # cells between samples: a ray through a voxel's corner seldom clears it
# Rays clear obstacles up to here, as far as depth_noise_m allows: a 3 cm leg is still a pixel wide.
CLEARING_RANGE_M = 5.0
ALIKE = 0.04  # of the depth: 12 cm at 3 m, three times the noise of a stereo camera there
NEIGHBOURS = 2  # of the eight: as a pixel of a vertical or horizontal line one pixel wide has


@compiled
def flying_pixels(depth_m: F32) -> Bool:
    """Mask (H, W) of pixels with depth with fewer than ``NEIGHBOURS`` of eight neighbours alike.

    ``ALIKE`` is of the depth of whichever of the two comes first, row by row. Pixels at the rim are
    not in the mask.
    """
    height, width = depth_m.shape
    share = np.float32(ALIKE)
    few = np.zeros((height, width), np.bool_)
    for i in range(1, height - 1):
        for j in range(1, width - 1):
            d = depth_m[i, j]
            own = share * d
            count = np.int32(abs(d - depth_m[i, j + 1]) <= own)
            count += np.int32(abs(d - depth_m[i + 1, j]) <= own)
            count += np.int32(abs(d - depth_m[i + 1, j + 1]) <= own)
            count += np.int32(abs(d - depth_m[i + 1, j - 1]) <= own)
            for other in (
                depth_m[i, j - 1],
                depth_m[i - 1, j],
                depth_m[i - 1, j - 1],
                depth_m[i - 1, j + 1],
            ):
                count += np.int32(abs(other - d) <= share * other)
            few[i, j] = (count < NEIGHBOURS) & (d > 0)
    return few


Places = tuple[F32, F32, F32, F32, F32]  # (n, 2 or 3) each: obstacles, low, drops, floor, blind


class ObstacleLimits(NamedTuple):
    """Height error per metre of z-depth; then metres: up to where there is floor, the heights of
    obstacles, and how far they are seen."""

    error_per_m: np.float32
    floor_m: np.float32
    lowest_m: np.float32
    highest_m: np.float32
    farthest_m: np.float32


@compiled
def obstacle_points(planes: tuple[F32, F32, F32, F32], limits: ObstacleLimits) -> tuple[F32, F32]:
    """Points (n, 3) on obstacles, and those (m, 3) between the heights of floor and obstacles.

    planes: depth, x, y, z (H, W).
    """
    depths, x, y, z = planes[0].ravel(), planes[1].ravel(), planes[2].ravel(), planes[3].ravel()
    kind = np.empty(len(z), np.uint8)
    for k in range(len(z)):
        error = limits.error_per_m * depths[k]
        inexact = depths[k] > np.float32(EXACT_HEIGHT_M)
        least = limits.lowest_m + (error if inexact else np.float32(0))
        usable = (depths[k] > 0) & (depths[k] <= limits.farthest_m)
        high = usable & (z[k] >= least) & (z[k] < limits.highest_m)
        low = usable & (z[k] > limits.floor_m + error) & (z[k] < least)
        kind[k] = np.uint8(high) + np.uint8(2) * np.uint8(low)
    return _of_kind(kind, 1, x, y, z), _of_kind(kind, 2, x, y, z)


@compiled
def _of_kind(kind: U8, wanted: int, x: F32, y: F32, z: F32) -> F32:
    """Points (n, 3) of those of x, y, z (k,) that are of this kind (k,)."""
    count = 0
    for k in range(len(kind)):
        count += kind[k] == wanted
    found = np.empty((count, 3), np.float32)
    row = 0
    for k in range(len(kind)):
        if kind[k] == wanted:
            found[row, 0], found[row, 1], found[row, 2] = x[k], y[k], z[k]
            row += 1
    return found


def ray_ends(cloud: PointCloud) -> F32:
    """Points (n, 3) with depth of every so manieth pixel of every so manieth row."""
    depth_m, *xyz = (plane[::RAY_STRIDE, ::RAY_STRIDE] for plane in cloud.planes)
    return np.stack([plane[depth_m > 0] for plane in xyz], axis=1)


def _covering(camera: F32, ends: F32, places: Places, cell_size_m: float) -> GridSpec:
    """The grid over what rays from camera (3,) to ends (m, 3) clear, and places."""
    rays = ends - camera
    x, y, z = rays.T
    length = np.maximum(np.sqrt(x * x + y * y + z * z), np.float32(1e-6))
    share = np.minimum(np.float32(CLEARING_RANGE_M) / length, np.float32(1))
    sides = []
    for k, along in enumerate((x, y)):  # each in one piece: minima of pairs are slow
        reached = camera[k] + along * share
        side = np.concatenate([camera[k : k + 1], reached, *(each[:, k] for each in places)])
        sides.append((float(side.min()), float(side.max())))
    (low_x, high_x), (low_y, high_y) = sides
    return GridSpec.covering(cell_size_m, (low_x, low_y), (high_x, high_y))


class VoxelGrid(NamedTuple):
    """The voxels of an update: world cell of [0, 0], cells along x and y, levels, metres."""

    x: int
    y: int
    nx: int
    ny: int
    levels: int
    cell_size_m: float
    lowest_m: np.float32
    thickness_m: np.float32
    highest_m: np.float32


@compiled
def _voxel(x: Any, y: Any, height: Any, grid: VoxelGrid) -> tuple[int, int, int]:
    """Indices of a point's voxel: of its cell in float64, of its level in float32."""
    i = np.int32(np.floor(np.float64(x) / grid.cell_size_m)) - np.int32(grid.x)
    j = np.int32(np.floor(np.float64(y) / grid.cell_size_m)) - np.int32(grid.y)
    level = np.int32((height - grid.lowest_m) / grid.thickness_m)
    return i, j, min(level, np.int32(grid.levels - 1))


@compiled
def _count_points(points: F32, grid: VoxelGrid) -> I32:
    """How many of the points (n, 3) lie in each voxel (nx, ny, levels), int32."""
    counts = np.zeros((grid.nx, grid.ny, grid.levels), np.int32)
    for k in range(len(points)):
        i, j, level = _voxel(points[k, 0], points[k, 1], points[k, 2], grid)
        counts[i, j, level] += 1
    return counts


@compiled
def _mark_rays(camera: F32, ends: F32, distances: F32, grid: VoxelGrid) -> Bool:
    """The voxels (nx, ny, levels) in the free space along the rays from camera (3,) to ends (m, 3).

    Sampled at ascending distances (k,); not in the last cell before the end, because depth noise
    moves a surface across cell borders.
    """
    crossed = np.zeros((grid.nx, grid.ny, grid.levels), np.bool_)
    flat = crossed.ravel()  # a view
    margin, voxels = np.float32(grid.cell_size_m), np.empty(len(distances), np.int32)
    for k in range(len(ends)):
        x, y, z = ends[k, 0] - camera[0], ends[k, 1] - camera[1], ends[k, 2] - camera[2]
        length = np.sqrt(x * x + y * y + z * z)
        scale = max(length, np.float32(1e-6))
        x, y, z = x / scale, y / scale, z / scale
        samples = 0
        while samples < len(distances) and distances[samples] <= length - margin:
            samples += 1
        for sample in range(samples):  # a loop of its own, made with vectors
            distance = distances[sample]
            height = camera[2] + z * distance
            inside = (height < grid.highest_m) & (height >= grid.lowest_m)
            i, j, level = _voxel(camera[0] + x * distance, camera[1] + y * distance, height, grid)
            voxel = np.int32((i * np.int32(grid.ny) + j) * np.int32(grid.levels) + level)
            voxels[sample] = voxel if inside else np.int32(-1)
        for voxel in voxels[:samples]:
            if voxel >= 0:
                flat[voxel] = True
    return crossed


@compiled
def _count_places(places_m: F32, grid: VoxelGrid) -> I32:
    """How many of the places (n, 2 or 3) lie in each cell (nx, ny), int32."""
    counts = np.zeros((grid.nx, grid.ny), np.int32)
    for k in range(len(places_m)):
        i, j, _ = _voxel(places_m[k, 0], places_m[k, 1], grid.lowest_m, grid)
        counts[i, j] += 1
    return counts


@compiled
def voxels_and_counts(
    camera: F32, ends: F32, distances: F32, places: Places, grid: VoxelGrid
) -> tuple[tuple[I32, Bool], tuple[I32, I32, I32, I32]]:
    """Voxels and counts of ``evidence_of``, from rays to ends (m, 3) and places."""
    obstacles, low, drops, seen, blind = places
    voxels = _count_points(obstacles, grid), _mark_rays(camera, ends, distances, grid)
    low_drops = _count_places(low, grid), _count_places(drops, grid)
    return voxels, (*low_drops, _count_places(seen, grid), _count_places(blind, grid))


def occupancy_update(cloud: PointCloud, params: MapParams) -> OccupancyUpdate:
    """Evidence of one depth image. Flying pixels are neither obstacles nor floor."""
    cloud = cloud.without(flying_pixels(cloud.depth_m))
    camera, planes = cloud.camera_m, cloud.planes
    rays = ray_ends(cloud)
    heights = (OBSTACLE_MIN_HEIGHT_M, params.obstacle_max_height_m)
    values = (HEIGHT_ERROR_PER_M, FLOOR_TOLERANCE_M, *heights, params.obstacle_range_m)
    obstacles, low = obstacle_points(planes, ObstacleLimits(*map(np.float32, values)))
    floor = floor_points(cloud, params)
    places = obstacles, low, floor.drops, floor.seen, floor.blind
    box = _covering(camera, rays, places, params.cell_size_m)
    lowest_m, thickness_m, highest_m = map(
        np.float32, (heights[0], params.voxel_height_m, heights[1])
    )
    grid = VoxelGrid(
        *box.origin_cell,
        *box.shape,
        params.levels,
        params.cell_size_m,
        lowest_m,
        thickness_m,
        highest_m,
    )
    voxels, counts = voxels_and_counts(camera, rays, ray_distances_m(params), places, grid)
    near = _near_enough(box, camera)
    return OccupancyUpdate(*evidence_of(voxels, counts, near, box.origin_cell))


def _near_enough(box: GridSpec, camera: F32) -> Bool:
    """Mask (nx, ny) of the cells in which the camera (3,) would see that floor is missing."""
    size_m = np.float32(box.cell_size_m)
    x, y = (
        (np.arange(count, dtype=np.float32) + np.float32(first + 0.5)) * size_m - at
        for count, first, at in zip(box.shape, box.origin_cell, camera[:2], strict=True)
    )
    near: Bool = (x * x)[:, None] + y * y <= NO_DROP_RANGE_M**2
    return near


def ray_distances_m(params: MapParams) -> F32:
    """Distances (k,) of a ray's samples from the camera, ascending.

    No further than points are obstacles: there a ray beside a leg would clear what no point renews.
    """
    step = RAY_STEP * params.cell_size_m
    range_m = min(CLEARING_RANGE_M, params.obstacle_range_m)
    return np.arange(step, range_m, step, dtype=np.float32)
