"""``occupancy.occupancy_update`` on a device; why it is done like this is said there."""

from __future__ import annotations

import torch
from torch import Tensor

from onemap_mapper.device.cloud import DeviceCloud, cells_of, divided, lengths
from onemap_mapper.device.floor import device_floor
from onemap_mapper.flying_pixels import ALIKE, NEIGHBOURS, STEPS
from onemap_mapper.occupancy import (
    DROP_HIT,
    EXACT_HEIGHT_M,
    HIT,
    LOW_HIT,
    MIN_HITS,
    MISS,
    RAY_STRIDE,
    SINGLE_HIT,
    OccupancyUpdate,
    ray_distances_m,
    voxel_thickness_m,
)
from onemap_mapper.params import OccupancyParams
from onemap_mapper.transfers import to_device, to_host
from onemap_shared.grid import GridSpec


def device_occupancy(cloud: DeviceCloud, params: OccupancyParams) -> OccupancyUpdate:
    """Evidence of one depth image, thinned to at most ``occupancy_max_rows`` rows.

    The host learns the bounds of what the image shows, and how many cells there are.
    """
    stride = -(-cloud.depth_m.shape[0] // params.occupancy_max_rows)
    cloud = cloud.strided(stride, stride)
    cloud = cloud.without(device_flying_pixels(cloud.depth_m))
    every = cloud.strided(RAY_STRIDE, RAY_STRIDE)
    camera = torch.tensor(cloud.camera_m, device=cloud.depth_m.device)
    ends = every.points(every.depth_m > 0)
    obstacles, low = _obstacles(cloud, params)
    floor = device_floor(cloud, params)
    reached = _reached(camera, ends, params)
    box = _box((floor.seen, floor.drops, floor.blind, obstacles, low, reached), params.cell_size_m)
    clear, blind = _counts(floor.seen, box) > 0, _counts(floor.blind, box) > 0
    samples = _ray_samples(camera, ends, params)
    voxels = _voxel_evidence(obstacles, samples, box, params)
    lowest = voxels[..., 0]
    lowest.masked_fill_((_counts(low, box) >= MIN_HITS) & (lowest < LOW_HIT), LOW_HIT)
    drop = (clear * -MISS).to(torch.int8)
    drop.masked_fill_(_counts(floor.drops, box) >= MIN_HITS, DROP_HIT)
    evidence = torch.cat([voxels, drop[..., None]], dim=2)
    place = torch.nonzero(clear | blind | evidence.any(dim=2), as_tuple=True)
    cells = torch.stack(
        [at + origin for at, origin in zip(place, box.origin_cell, strict=True)], dim=1
    )
    return OccupancyUpdate(cells, evidence[place], clear[place], blind[place])


def device_flying_pixels(depth_m: Tensor) -> Tensor:
    """Mask (H, W), as ``flying_pixels``."""
    alike = torch.full_like(depth_m, NEIGHBOURS, dtype=torch.uint8)
    alike[1:-1, 1:-1] = 0
    limit = ALIKE * depth_m
    rows, columns = depth_m.shape
    for down, right in STEPS:
        here = (slice(0, rows - down), slice(max(-right, 0), columns - max(right, 0)))
        there = (slice(down, rows), slice(max(right, 0), columns + min(right, 0)))
        close = (depth_m[here] - depth_m[there]).abs() <= limit[here]
        alike[here] += close
        alike[there] += close
    return (alike < NEIGHBOURS) & (depth_m > 0)


def _obstacles(cloud: DeviceCloud, params: OccupancyParams) -> tuple[Tensor, Tensor]:
    """Points (n, 3) on obstacles, and those (m, 3) between the heights of floor and obstacles."""
    depth_m, z = cloud.depth_m, cloud.z_m
    error = params.height_error_per_m * depth_m
    slack = torch.where(depth_m > EXACT_HEIGHT_M, error, 0.0)
    least = params.obstacle_min_height_m + slack
    usable = (depth_m > 0) & (depth_m <= params.obstacle_range_m)
    high = usable & (z >= least) & (z < params.obstacle_max_height_m)
    low = usable & (z > params.floor_tolerance_m + error) & (z < least)
    return cloud.points(high), cloud.points(low)


def _reached(camera: Tensor, ends: Tensor, params: OccupancyParams) -> Tensor:
    """Camera, and ends of rays no further than the clearing range: (m + 1, 3)."""
    rays = ends - camera
    length_m = lengths(rays)
    range_m = torch.full_like(length_m, params.clearing_range_m)
    share = (range_m / length_m.clamp(min=1e-6)).clamp(max=1.0)
    return torch.cat([camera[None], camera + rays * share[:, None]])


def _ray_samples(camera: Tensor, ends: Tensor, params: OccupancyParams) -> Tensor:
    """Points (n, 3) in free space, as ``occupancy.ray_samples``."""
    rays = ends - camera
    length_m = lengths(rays)
    distances_m = to_device(ray_distances_m(params), camera.device)
    rays = rays / length_m.clamp(min=1e-6)[:, None]
    z = camera[2] + rays[:, 2, None] * distances_m
    inside = distances_m <= (length_m - params.cell_size_m)[:, None]
    inside &= (z < params.obstacle_max_height_m) & (z >= params.obstacle_min_height_m)
    ray, sample = torch.nonzero(inside, as_tuple=True)
    return camera + rays[ray] * distances_m[sample, None]


def _voxel_evidence(
    obstacles: Tensor, samples: Tensor, box: GridSpec, params: OccupancyParams
) -> Tensor:
    """Evidence (nx, ny, levels) int8 of points on obstacles and of free space along rays."""
    shape = (*box.shape, params.levels)
    hits = _scattered(_voxels(obstacles, box, params), shape)
    crossed = _scattered(_voxels(samples, box, params), shape) > 0
    evidence = (crossed * -MISS).to(torch.int8)
    return evidence.masked_fill_(hits > 0, SINGLE_HIT).masked_fill_(hits >= MIN_HITS, HIT)


def _voxels(points: Tensor, box: GridSpec, params: OccupancyParams) -> Tensor:
    """Flat voxel indices (n,) in (nx, ny, levels), as ``occupancy.voxel_indices``."""
    height_m = points[:, 2] - params.obstacle_min_height_m
    level = divided(height_m, voxel_thickness_m(params)).long()
    return _flat(points, box) * params.levels + level.clamp(max=params.levels - 1)


def _counts(places: Tensor, box: GridSpec) -> Tensor:
    """How many of the places (n, 2 or 3) lie in each cell (nx, ny)."""
    return _scattered(_flat(places, box), box.shape)


def _flat(places: Tensor, box: GridSpec) -> Tensor:
    """Flat indices (n,) in (nx, ny) of places (n, 2 or 3) inside the box."""
    cells = cells_of(places, box.cell_size_m)
    (low_x, low_y), (_, depth) = box.origin_cell, box.shape
    return (cells[:, 0] - low_x) * depth + cells[:, 1] - low_y


def _scattered(flat: Tensor, shape: tuple[int, ...]) -> Tensor:
    """How often each element of an array of this shape is among flat indices (n,), int32."""
    counts = torch.zeros(shape, dtype=torch.int32, device=flat.device)
    counts.view(-1).index_add_(0, flat, torch.ones_like(flat, dtype=torch.int32))
    return counts


def _box(clouds: tuple[Tensor, ...], cell_size_m: float) -> GridSpec:
    places = torch.cat([cloud[:, :2] for cloud in clouds])
    bounds = to_host(torch.stack([places.amin(dim=0), places.amax(dim=0)])).tolist()
    (low_x, low_y), (high_x, high_y) = bounds
    return GridSpec.covering(cell_size_m, (low_x, low_y), (high_x, high_y))
