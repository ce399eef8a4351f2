"""The evidence of one depth image by torch, on a GPU or where nothing can be compiled.

The same rules as in ``floor`` and ``host``, which give the reasons, with the same result bit for
bit.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import torch
from torch import Tensor

from onemap_mapper.frame.cloud import DeviceCloud, cells_of, divided, lengths
from onemap_mapper.occupancy.evidence import (
    DROP_HIT,
    HIT,
    LOW_HIT,
    MIN_HITS,
    MISS,
    SINGLE_HIT,
    OccupancyUpdate,
)
from onemap_mapper.occupancy.floor import (
    ACROSS_SAMPLES,
    BLIND_SAMPLES,
    BLIND_SIDE,
    COLUMNS,
    DROP_MIN_DEPTH_M,
    DROP_RANGE_M,
    FLOOR_GAP_M,
    FLOOR_TOLERANCE_M,
    HEIGHT_ERROR_PER_M,
    JUMP_ROWS,
    MISSING_COLUMNS,
    MISSING_FLOOR_RANGE_M,
    MISSING_ROWS,
    MISSING_SHARE,
    RISER_ROWS,
    RISER_SAMPLES,
    RISER_SLOPE,
    TILT_ERROR_PER_M,
)
from onemap_mapper.occupancy.host import (
    ALIKE,
    CLEARING_RANGE_M,
    EXACT_HEIGHT_M,
    NEIGHBOURS,
    RAY_STRIDE,
    STEPS,
    ray_distances_m,
)
from onemap_mapper.params import OBSTACLE_MIN_HEIGHT_M, MapParams
from onemap_mapper.transfers import to_device, to_host
from onemap_shared.grid import GridSpec


@dataclass(frozen=True, slots=True)
class DeviceFloor:
    """Places (n, 2) float32 in metres, as ``floor.FloorPoints``."""

    seen: Tensor
    drops: Tensor
    blind: Tensor


@dataclass(frozen=True, slots=True)
class _Image:
    """Planes (rows, columns) of a cloud: depth, x and y from the camera, and height, metres."""

    depth: Tensor
    x: Tensor
    y: Tensor
    z: Tensor
    camera: tuple[float, float, float]

    @classmethod
    def of(cls, cloud: DeviceCloud) -> _Image:
        cloud = cloud.strided(1, max(1, cloud.depth_m.shape[1] // COLUMNS))
        camera = cloud.camera_m
        return cls(cloud.depth_m, cloud.x_m - camera[0], cloud.y_m - camera[1], cloud.z_m, camera)

    @property
    def xy(self) -> Tensor:
        """(rows, columns, 2): ground positions from the camera."""
        return torch.stack([self.x, self.y], dim=-1)

    def in_map(self, xy: Tensor) -> Tensor:
        """Places (..., 2) in the map frame of ground positions from the camera."""
        return torch.stack([xy[..., 0] + self.camera[0], xy[..., 1] + self.camera[1]], dim=-1)


def device_floor(cloud: DeviceCloud, params: MapParams) -> DeviceFloor:
    """The floor and the drops that one depth image shows."""
    image = _Image.of(cloud)
    valid = image.depth > 0
    slack = HEIGHT_ERROR_PER_M * image.depth
    fall = DROP_MIN_DEPTH_M + slack
    edge = _edges(image, valid, fall)
    floor = valid & (image.z <= FLOOR_TOLERANCE_M + slack) & (image.z >= -fall)
    floor &= image.depth <= params.occupancy_range_m
    floor &= ~_behind_edge(image, edge)
    feet = _riser_feet(image, valid)
    floor &= feet == 0
    low = image.z < -(DROP_MIN_DEPTH_M + TILT_ERROR_PER_M * image.depth)
    before = torch.cat([image.z[JUMP_ROWS:], image.z[-JUMP_ROWS:]])  # an edge's height
    drops = [
        _crossings(image, edge, before),
        _crossings(image, valid & low, torch.zeros_like(image.z)),
        _before_risers(image, feet),
        *_missing(image, valid, floor, params.cell_size_m),
    ]
    seen = [image.in_map(image.xy[floor]), *_between(image, floor, params.cell_size_m)]
    return DeviceFloor(torch.cat(seen), torch.cat(drops), _blind(image, floor))


def _edges(image: _Image, valid: Tensor, fall: Tensor) -> Tensor:
    """Pixels just beyond the edge of a step down: floor in the image below them, and they fall."""
    near, far = slice(JUMP_ROWS, None), slice(None, -JUMP_ROWS)
    z = image.z
    reach = FLOOR_TOLERANCE_M + TILT_ERROR_PER_M * image.depth[near]
    found = valid[near] & valid[far] & (z[near].abs() <= reach)
    found &= (z[near] - z[far] > fall[near]) & (z[far] < -DROP_MIN_DEPTH_M / 2)
    return torch.cat([found, torch.zeros_like(valid[-JUMP_ROWS:])])


def _behind_edge(image: _Image, edge: Tensor) -> Tensor:
    """Pixels above an edge in their column that lie lower than half its height."""
    none = len(edge) - 1
    row = torch.arange(len(edge), device=edge.device)[:, None]
    nearest = torch.where(edge, row, none).flip(0).cummin(dim=0).values.flip(0)
    before = (nearest + JUMP_ROWS).clamp(max=none)
    middle = (image.z.gather(0, before) + image.z.gather(0, nearest)) / 2
    return (nearest < none) & (image.z < middle)


def _riser_feet(image: _Image, valid: Tensor) -> Tensor:
    """(rows, columns): how many rows below a riser's pixel its foot is; 0: no riser."""
    depth, z = image.depth, image.z
    window = max(2, len(depth) // RISER_ROWS)
    feet = torch.zeros_like(depth, dtype=torch.int64)
    if len(depth) <= window:
        return feet
    low = valid & (z < -DROP_MIN_DEPTH_M / 2)
    fall = DROP_MIN_DEPTH_M + HEIGHT_ERROR_PER_M * depth
    top = valid & (z.abs() <= FLOOR_TOLERANCE_M + TILT_ERROR_PER_M * depth)
    top &= depth <= DROP_RANGE_M
    top[:window] = False
    top[window:] &= valid[:-window] & ~_is_steep(image, window)
    for k in range(1, window + 1):
        upper, lower = slice(None, -k), slice(k, None)
        there = top[upper] & low[lower] & (feet[upper] == 0)
        there &= (z[upper] - z[lower] > fall[upper]) & _is_steep(image, k)
        feet[upper] = torch.where(there, k, feet[upper])
    return feet


def _is_steep(image: _Image, rows: int) -> Tensor:
    """Whether it rises steeply from each pixel but the first ``rows`` to the one so far above."""
    dx, dy, rise = (plane[:-rows] - plane[rows:] for plane in (image.x, image.y, image.z))
    return (rise > 0) & (RISER_SLOPE**2 * (dx * dx + dy * dy) <= rise * rise)


def _before_risers(image: _Image, feet: Tensor) -> Tensor:
    """Places (n, 2) before risers: from where the ray to the foot crosses the height of the top."""
    row, column = torch.nonzero(feet, as_tuple=True)
    foot = row + feet[row, column]
    scale = image.camera[2] - image.z[row, column]
    scale = scale / (image.camera[2] - image.z[foot, column]).clamp(min=1e-3)
    top_xy, foot_xy = image.xy[row, column], image.xy[foot, column] * scale[:, None]
    share = divided(_numbers(RISER_SAMPLES, image), RISER_SAMPLES)[:, None]
    return image.in_map(foot_xy[:, None] + (top_xy - foot_xy)[:, None] * share).reshape(-1, 2)


def _crossings(image: _Image, chosen: Tensor, height_m: Tensor) -> Tensor:
    """Where the rays to chosen pixels cross a height (rows, columns)."""
    above = image.camera[2] - height_m[chosen]
    scale = above / (image.camera[2] - image.z[chosen]).clamp(min=1e-3)
    near = (scale > 0) & (scale * image.depth[chosen] <= DROP_RANGE_M)
    return image.in_map(image.xy[chosen] * scale[:, None])[near]


def _missing(image: _Image, valid: Tensor, floor: Tensor, cell_size_m: float) -> list[Tensor]:
    """Places just beyond floor that ends at a large hole without returns, and across the hole."""
    rows, columns = valid.shape
    tall, wide = max(2, rows // MISSING_ROWS), max(1, columns // MISSING_COLUMNS)
    near = floor & (image.depth <= MISSING_FLOOR_RANGE_M)
    count = torch.zeros((rows + 1, columns + 1), dtype=torch.int64, device=valid.device)
    count[1:, 1:] = (~valid).long().cumsum(dim=0).cumsum(dim=1)
    places = []
    for down, right in (-1, 0), (0, -1), (0, 1):  # to the pixel that is missing: row, column
        beside = valid[1 + down : rows - 1 + down, 1 + right : columns - 1 + right]
        row, column = (1 + at for at in torch.nonzero(near[1:-1, 1:-1] & ~beside, as_tuple=True))
        top = (row - tall).clamp(min=0)
        left = (column + (-wide // 2 if right == 0 else right * wide)).clamp(min=0)
        left = torch.minimum(left, column + right)
        bottom, end = (top + tall).clamp(max=rows), (left + wide).clamp(max=columns)
        missing = count[bottom, end] - count[top, end] - count[bottom, left] + count[top, left]
        large = missing.double() >= MISSING_SHARE * tall * wide
        row, column = row[large], column[large]
        places.append(_beyond(image, (row, column), (down, right), cell_size_m))
        if (down, right) == (-1, 0):
            places.append(_across(image, (row, column), valid, floor))
    return places


def _beyond(
    image: _Image, at: tuple[Tensor, Tensor], step: tuple[int, int], cell_size_m: float
) -> Tensor:
    """Places (n, 2) one cell from the pixels ``at``, away from the camera or sideways."""
    xy = image.xy[at]
    ahead = xy / lengths(xy).clamp(min=1e-3)[:, None]
    right = torch.stack([ahead[:, 1], -ahead[:, 0]], dim=1)
    return image.in_map(xy + cell_size_m * (ahead if step[0] else step[1] * right))


def _across(image: _Image, at: tuple[Tensor, Tensor], valid: Tensor, floor: Tensor) -> Tensor:
    """Places between pixels ``at`` and the next return above them, where that is floor."""
    row, column = at
    rows = torch.arange(len(valid), device=valid.device)[:, None]
    last = torch.where(valid, rows, -1).cummax(dim=0).values
    far = last[row - 1, column]
    there = (far >= 0) & floor[far, column]
    row, column, far = row[there], column[there], far[there]
    near_xy, far_xy = image.xy[row, column], image.xy[far, column]
    share = divided(_numbers(ACROSS_SAMPLES, image) + 0.5, ACROSS_SAMPLES)[:, None]
    between = near_xy[:, None] + (far_xy - near_xy)[:, None] * share
    return image.in_map(between).reshape(-1, 2)


def _between(image: _Image, floor: Tensor, cell_size_m: float) -> list[Tensor]:
    """Places between floor pixels that are neighbours in a column but cells apart."""
    both = floor[:-1] & floor[1:]
    upper, step = image.xy[:-1][both], image.xy.diff(dim=0)[both]
    gap_m = torch.hypot(step[:, 0], step[:, 1])
    wide = (gap_m > cell_size_m) & (gap_m <= FLOOR_GAP_M)
    upper, step = image.in_map(upper[wide]), step[wide]
    count = ceil(FLOOR_GAP_M / cell_size_m)
    return [upper + step * (k / count) for k in range(1, count)]


def _blind(image: _Image, floor: Tensor) -> Tensor:
    """Places from the camera's foot to the floor at the lower edge of the image.

    Only where the lower edge shows floor to both sides too: beside a hole there is an edge.
    """
    side = floor.shape[1] // BLIND_SIDE
    others = torch.nn.functional.pad((~floor[-1]).long(), (side + 1, side)).cumsum(dim=0)
    nearest = others[2 * side + 1 :] == others[: -2 * side - 1]
    share = divided(_numbers(BLIND_SAMPLES, image), BLIND_SAMPLES)[:, None]
    return image.in_map(image.xy[-1][nearest][:, None] * share).reshape(-1, 2)


def _numbers(count: int, image: _Image) -> Tensor:
    """0, 1, ... (count,) float32."""
    return torch.arange(count, device=image.depth.device, dtype=torch.float32)


def device_occupancy(cloud: DeviceCloud, params: MapParams) -> OccupancyUpdate:
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
    reached = _reached(camera, ends)
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
    """Mask (H, W), as ``host.few_alike``."""
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


def _obstacles(cloud: DeviceCloud, params: MapParams) -> tuple[Tensor, Tensor]:
    """Points (n, 3) on obstacles, and those (m, 3) between the heights of floor and obstacles."""
    depth_m, z = cloud.depth_m, cloud.z_m
    error = HEIGHT_ERROR_PER_M * depth_m
    slack = torch.where(depth_m > EXACT_HEIGHT_M, error, 0.0)
    least = OBSTACLE_MIN_HEIGHT_M + slack
    usable = (depth_m > 0) & (depth_m <= params.obstacle_range_m)
    high = usable & (z >= least) & (z < params.obstacle_max_height_m)
    low = usable & (z > FLOOR_TOLERANCE_M + error) & (z < least)
    return cloud.points(high), cloud.points(low)


def _reached(camera: Tensor, ends: Tensor) -> Tensor:
    """Camera, and ends of rays no further than the clearing range: (m + 1, 3)."""
    rays = ends - camera
    length_m = lengths(rays)
    range_m = torch.full_like(length_m, CLEARING_RANGE_M)
    share = (range_m / length_m.clamp(min=1e-6)).clamp(max=1.0)
    return torch.cat([camera[None], camera + rays * share[:, None]])


def _ray_samples(camera: Tensor, ends: Tensor, params: MapParams) -> Tensor:
    """Points (n, 3) in free space along rays, as ``host.mark_rays``."""
    rays = ends - camera
    length_m = lengths(rays)
    distances_m = to_device(ray_distances_m(params), camera.device)
    rays = rays / length_m.clamp(min=1e-6)[:, None]
    z = camera[2] + rays[:, 2, None] * distances_m
    inside = distances_m <= (length_m - params.cell_size_m)[:, None]
    inside &= (z < params.obstacle_max_height_m) & (z >= OBSTACLE_MIN_HEIGHT_M)
    ray, sample = torch.nonzero(inside, as_tuple=True)
    return camera + rays[ray] * distances_m[sample, None]


def _voxel_evidence(obstacles: Tensor, samples: Tensor, box: GridSpec, params: MapParams) -> Tensor:
    """Evidence (nx, ny, levels) int8 of points on obstacles and of free space along rays."""
    shape = (*box.shape, params.levels)
    hits = _scattered(_voxels(obstacles, box, params), shape)
    crossed = _scattered(_voxels(samples, box, params), shape) > 0
    evidence = (crossed * -MISS).to(torch.int8)
    return evidence.masked_fill_(hits > 0, SINGLE_HIT).masked_fill_(hits >= MIN_HITS, HIT)


def _voxels(points: Tensor, box: GridSpec, params: MapParams) -> Tensor:
    """Flat voxel indices (n,) in (nx, ny, levels), as of ``host.VoxelGrid``."""
    height_m = points[:, 2] - OBSTACLE_MIN_HEIGHT_M
    level = divided(height_m, params.voxel_height_m).long()
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
