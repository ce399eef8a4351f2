"""x"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.jit import compiled
from onemap_mapper.occupancy.evidence import (
    DROP_HIT,
    HIT,
    LOW_HIT,
    MIN_HITS,
    MISS,
    SINGLE_HIT,
    OccupancyUpdate,
)
from onemap_mapper.occupancy.floor import floor_points
from onemap_mapper.params import OccupancyParams
from onemap_shared.geometry import F32, I32, I64, Bool
from onemap_shared.grid import GridSpec

ALIKE = 0.04  # of the depth: 12 cm at 3 m, three times the noise of a stereo camera there
NEIGHBOURS = 2  # of the eight: as a pixel of a vertical or horizontal line one pixel wide has
STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))  # rows, columns: half of the eight neighbours


@compiled
def few_alike(depth_m: F32, alike: float, neighbours: int) -> Bool:  # pragma: no cover
    """Mask (H, W) of pixels with depth with fewer than so many of eight neighbours alike.

    alike: the greatest difference, as a share of the depth of whichever of the two comes first,
    row by row. Pixels at the rim are not in the mask.
    """
    height, width = depth_m.shape
    share = np.float32(alike)
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
            few[i, j] = (count < neighbours) & (d > 0)
    return few


@compiled
def obstacle_points(
    depth_m: F32, planes_m: F32, limits: F32
) -> tuple[F32, F32]:  # pragma: no cover
    """Points (n, 3) on obstacles and (m, 3) too low for one, as ``occupancy._obstacles``.

    planes_m (3, H, W): x, y, z; limits float32: (height error per metre, depth m up to which an
    obstacle needs no slack, lowest height m of an obstacle, end of it m, farthest depth m, greatest
    height m of floor).
    """
    error_per_m, exact, least_height, highest, farthest, floor = limits
    pixels = depth_m.size
    depths, x, y, z = depth_m.ravel(), planes_m[0].ravel(), planes_m[1].ravel(), planes_m[2].ravel()
    kind = np.empty(pixels, np.uint8)
    for k in range(pixels):
        error = error_per_m * depths[k]
        least = least_height + (error if depths[k] > exact else np.float32(0))
        usable = (depths[k] > 0) & (depths[k] <= farthest)
        high = usable & (z[k] >= least) & (z[k] < highest)
        low = usable & (z[k] > floor + error) & (z[k] < least)
        kind[k] = np.uint8(high) + np.uint8(2) * np.uint8(low)
    high_at, low_at = np.flatnonzero(kind == 1), np.flatnonzero(kind == 2)
    found = np.empty((len(high_at), 3), np.float32), np.empty((len(low_at), 3), np.float32)
    for of_kind, at in zip(found, (high_at, low_at)):  # noqa: B905 (compiled code knows no strict)
        for row in range(len(at)):
            k = at[row]
            of_kind[row, 0], of_kind[row, 1], of_kind[row, 2] = x[k], y[k], z[k]
    return found


@compiled
def every_point(depth_m: F32, points_m: F32, stride: int) -> F32:  # pragma: no cover
    """Points (n, 3) with depth of every so manieth pixel of every so manieth row."""
    height, width = depth_m.shape
    found = np.empty((-(-height // stride) * -(-width // stride), 3), np.float32)
    filled = 0
    for i in range(0, height, stride):
        for j in range(0, width, stride):
            if depth_m[i, j] > 0:
                for k in range(3):
                    found[filled, k] = points_m[i, j, k]
                filled += 1
    return found[:filled]


@compiled
def bounds_of(places_m: F32) -> tuple[float, float, float, float]:  # pragma: no cover
    """The least and greatest x and y of places (n, 2 or 3): low x, low y, high x, high y.

    Infinite where there are none, the low ones above the high ones.
    """
    low_x = low_y = np.float32(np.inf)
    high_x = high_y = -np.float32(np.inf)
    for k in range(len(places_m)):
        x, y = places_m[k, 0], places_m[k, 1]
        low_x, low_y = min(low_x, x), min(low_y, y)
        high_x, high_y = max(high_x, x), max(high_y, y)
    return low_x, low_y, high_x, high_y


@compiled
def reached_bounds(
    camera: F32, ends: F32, range_m: F32
) -> tuple[float, float, float, float]:  # pragma: no cover
    """``bounds_of`` the camera (3,) and the ends (m, 3) of rays, shortened as ``_cleared`` does.

    range_m (1,): how far rays clear.
    """
    low_x = high_x = camera[0]
    low_y = high_y = camera[1]
    for k in range(len(ends)):
        x, y, z = ends[k, 0] - camera[0], ends[k, 1] - camera[1], ends[k, 2] - camera[2]
        length = np.sqrt(x * x + y * y + z * z)
        share = min(range_m[0] / max(length, np.float32(1e-6)), np.float32(1))
        x, y = camera[0] + x * share, camera[1] + y * share
        low_x, low_y = min(low_x, x), min(low_y, y)
        high_x, high_y = max(high_x, x), max(high_y, y)
    return low_x, low_y, high_x, high_y


Shape = tuple[int, int, int]  # cells along x and y, levels


@compiled
def count_points(
    points: F32, origin: tuple[int, int], shape: Shape, cell_size_m: float, band: F32
) -> I32:  # pragma: no cover
    """How many of the points (n, 3) lie in each voxel (nx, ny, levels), int32.

    origin: world cell of voxel [0, 0]; band: (lowest height m, thickness of a level m) float32.
    """
    counts = np.zeros(shape, np.int32)
    lowest, thickness = band
    for k in range(len(points)):
        i = _cell(points[k, 0], cell_size_m) - origin[0]
        j = _cell(points[k, 1], cell_size_m) - origin[1]
        level = np.int64((points[k, 2] - lowest) / thickness)
        counts[i, j, min(level, shape[2] - 1)] += 1
    return counts


@compiled
def mark_rays(
    rays: tuple[F32, F32, F32], origin: tuple[int, int], shape: Shape, cell_size_m: float, band: F32
) -> Bool:  # pragma: no cover
    """The voxels (nx, ny, levels) in which the samples of ``occupancy.ray_samples`` lie.

    rays: camera (3,), ends (m, 3), ascending distances (k,) of samples from the camera, m; band:
    (lowest height m, thickness of a level m, greatest height m, margin m before the end) float32.
    """
    camera, ends, distances = rays
    lowest, thickness, highest, margin = band
    crossed = np.zeros(shape, np.bool_)
    for k in range(len(ends)):
        x, y, z = ends[k, 0] - camera[0], ends[k, 1] - camera[1], ends[k, 2] - camera[2]
        length = np.sqrt(x * x + y * y + z * z)
        scale = max(length, np.float32(1e-6))
        x, y, z = x / scale, y / scale, z / scale
        for distance in distances:
            if distance > length - margin:
                break
            height = camera[2] + z * distance
            if height >= highest or height < lowest:
                continue
            i = _cell(camera[0] + x * distance, cell_size_m) - origin[0]
            j = _cell(camera[1] + y * distance, cell_size_m) - origin[1]
            level = np.int64((height - lowest) / thickness)
            crossed[i, j, min(level, shape[2] - 1)] = True
    return crossed


@compiled
def _cell(x_m: float, cell_size_m: float) -> int:  # pragma: no cover
    return int(np.floor(np.float64(x_m) / cell_size_m))


Counts = tuple[I32, I32, I32, I32]  # (nx, ny) each: low points, drops, floor, blind


@compiled
def count_places(
    places_m: F32, origin: tuple[int, int], shape: tuple[int, int], cell_size_m: float
) -> I32:  # pragma: no cover
    """How many of the places (n, 2 or 3) lie in each cell (nx, ny), int32."""
    counts = np.zeros(shape, np.int32)
    for k in range(len(places_m)):
        i = int(np.floor(np.float64(places_m[k, 0]) / cell_size_m)) - origin[0]
        j = int(np.floor(np.float64(places_m[k, 1]) / cell_size_m)) - origin[1]
        counts[i, j] += 1
    return counts


@compiled
def evidence_of(
    voxels: tuple[I32, Bool], counts: Counts, origin: tuple[int, int], weights: I64
) -> tuple[I64, NDArray[np.int8], Bool, Bool]:  # pragma: no cover
    """Cells (n, 2), evidence (n, levels + 1), clear and blind (n,) of ``OccupancyUpdate``.

    voxels: points in each voxel (nx, ny, levels), and whether a ray crosses it; weights: (evidence
    of several points, of one, of low points, of a drop, of a miss, and how many are several).
    """
    (hits, crossed), (low, drops, seen, blind) = voxels, counts
    hit, single, low_hit, drop_hit, miss, several = weights
    nx, ny, levels = hits.shape
    cells = np.empty((nx * ny, 2), np.int64)
    evidence = np.empty((nx * ny, levels + 1), np.int8)
    clear, hidden = np.empty(nx * ny, np.bool_), np.empty(nx * ny, np.bool_)
    filled = 0
    for i in range(nx):
        for j in range(ny):
            floor = seen[i, j] > 0
            touched = floor | (blind[i, j] > 0)
            row = evidence[filled]
            for level in range(levels):
                value = -miss if crossed[i, j, level] else np.int64(0)
                value = single if hits[i, j, level] > 0 else value
                value = hit if hits[i, j, level] >= several else value
                if level == 0 and low[i, j] >= several and value < low_hit:
                    value = low_hit
                row[level] = value
                touched |= value != 0
            value = -miss if floor else np.int64(0)
            value = drop_hit if drops[i, j] >= several else value
            row[levels] = value
            if touched | (value != 0):
                cells[filled, 0], cells[filled, 1] = i + origin[0], j + origin[1]
                clear[filled], hidden[filled] = floor, blind[i, j] > 0
                filled += 1
    return cells[:filled], evidence[:filled], clear[:filled], hidden[:filled]


WEIGHTS = np.array([HIT, SINGLE_HIT, LOW_HIT, DROP_HIT, MISS, MIN_HITS])
EXACT_HEIGHT_M = 2.0  # nearer heights need no slack: an error of 1 degree is 35 mm there
RAY_STRIDE = 4  # of the thinned image: rays 0.1 m apart at the clearing range
RAY_STEP = 1.0  # cells between samples: a ray through a voxel's corner seldom clears it


def occupancy_update(cloud: PointCloud, params: OccupancyParams) -> OccupancyUpdate:
    """Evidence of one depth image, thinned to at most ``occupancy_max_rows`` rows.

    Flying pixels are neither obstacles nor floor. Computed on the host.
    """
    cloud = cloud.strided(-(-cloud.depth_m.shape[0] // params.occupancy_max_rows))
    cloud = cloud.without(few_alike(np.ascontiguousarray(cloud.depth_m), ALIKE, NEIGHBOURS))
    size_m, camera = params.cell_size_m, cloud.camera_m.astype(np.float32)
    rays = every_point(cloud.depth_m, cloud.points_m, RAY_STRIDE)
    limits = (
        params.height_error_per_m,
        EXACT_HEIGHT_M,
        params.obstacle_min_height_m,
        params.obstacle_max_height_m,
        params.obstacle_range_m,
        params.floor_tolerance_m,
    )
    obstacles, low = obstacle_points(cloud.depth_m, cloud.planes_m, np.array(limits, np.float32))
    floor = floor_points(cloud, params)
    clouds = (low, floor.drops, floor.seen, floor.blind)
    reached = reached_bounds(camera, rays, np.array([params.clearing_range_m], np.float32))
    bounds = np.array([reached, bounds_of(obstacles), *map(bounds_of, clouds)])
    (low_x, low_y), (high_x, high_y) = bounds[:, :2].min(axis=0), bounds[:, 2:].max(axis=0)
    box = GridSpec.covering(size_m, (float(low_x), float(low_y)), (float(high_x), float(high_y)))
    low_m, high_m = params.obstacle_min_height_m, params.obstacle_max_height_m
    band = np.array([low_m, voxel_thickness_m(params), high_m, size_m], np.float32)
    where = (box.origin_cell, (*box.shape, params.levels), size_m)
    voxels = (
        count_points(obstacles, *where, band[:2]),
        mark_rays((camera, rays, ray_distances_m(params)), *where, band),
    )
    below, drops, seen, blind = (
        count_places(places, box.origin_cell, box.shape, size_m) for places in clouds
    )
    return OccupancyUpdate.of_arrays(
        *evidence_of(voxels, (below, drops, seen, blind), box.origin_cell, WEIGHTS)
    )


def ray_distances_m(params: OccupancyParams) -> F32:
    """Distances (k,) of a ray's samples from the camera, ascending.

    No further than points are obstacles: there a ray beside a leg would clear what no point renews.
    """
    step = RAY_STEP * params.cell_size_m
    range_m = min(params.clearing_range_m, params.obstacle_range_m)
    return np.arange(step, range_m, step, dtype=np.float32)


def voxel_thickness_m(params: OccupancyParams) -> float:
    """Height of a voxel."""
    return (params.obstacle_max_height_m - params.obstacle_min_height_m) / params.levels
