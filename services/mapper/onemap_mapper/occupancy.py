"""Occupancy from depth: free, occupied and unknown cells.

Each cell is a column of voxels over the heights of the robot's body. A point is evidence for its
voxel; a ray that passes through a voxel and ends behind it is evidence against it. So a ray over a
coffee table does not clear the table, and the floor seen under a table does not either. One more
voxel lies below the floor: a drop fills it, floor that is seen empties it. A cell is free once its
floor was seen and no voxel of its column is occupied; a ray that passes just above a cell does not
show that there is floor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from onemap_mapper.floor import floor_points
from onemap_mapper.flying_pixels import flying_pixels
from onemap_mapper.kernels import jit
from onemap_mapper.kernels.occupancy_cells import count_places, evidence_of
from onemap_mapper.kernels.occupancy_points import (
    bounds_of,
    every_point,
    obstacle_points,
    reached_bounds,
)
from onemap_mapper.kernels.voxels import count_points, mark_rays
from onemap_mapper.params import OccupancyParams
from onemap_mapper.point_cloud import PointCloud
from onemap_mapper.transfers import CPU, to_device
from onemap_shared.geometry import F32, F64, I64, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy

I8 = NDArray[np.int8]

# Evidence is a log-odds in steps of about 0.4, an int8 per voxel.
HIT = 4  # MIN_HITS points or more: an unobserved voxel becomes occupied at once
SINGLE_HIT = 2  # one point: a far leg or table edge, or noise, so two frames are needed
LOW_HIT = 2  # too high for floor, too low for an obstacle: the edge of a tray, or a tilted floor
DROP_HIT = 2  # a drop needs two frames: an error of the pitch lowers all floor of one frame
MISS = 1  # four frames erase what was hit in one frame, twelve what was hit in many
MAX_EVIDENCE = 12  # bounded, so that a removed obstacle disappears within twelve frames
MIN_EVIDENCE = -4  # and a new one appears within two
OCCUPIED_THRESHOLD = 3
SETTLED_EVIDENCE = 10  # three frames of an unobserved cell, four of a free one: no passer-by
MIN_HITS = 2
WEIGHTS = np.array([HIT, SINGLE_HIT, LOW_HIT, DROP_HIT, MISS, MIN_HITS])
EXACT_HEIGHT_M = 2.0  # nearer heights need no slack: an error of 1 degree is 35 mm there
RAY_STRIDE = 4  # of the thinned image: rays 0.1 m apart at the clearing range
RAY_STEP = 1.0  # cells between samples: a ray through a voxel's corner seldom clears it


@dataclass(frozen=True, slots=True)
class OccupancyUpdate:
    """The evidence of one frame, per cell, on the device of the map.

    cells (n, 2) int64 world cells; evidence (n, levels + 1) int8 to add, the last for the voxel
    below the floor; clear (n,) bool: the floor was seen; blind (n,) bool: the cell lies between
    the camera and the nearest floor in view.
    """

    cells: Tensor
    evidence: Tensor
    clear: Tensor
    blind: Tensor

    @classmethod
    def of_arrays(
        cls, cells: I64, evidence: I8, clear: Bool, blind: Bool, *, device: torch.device = CPU
    ) -> OccupancyUpdate:
        """The evidence that arrays on the host hold."""
        return cls(*(to_device(each, device) for each in (cells, evidence, clear, blind)))


def occupancy_update(cloud: PointCloud, params: OccupancyParams) -> OccupancyUpdate:
    """Evidence of one depth image, thinned to at most ``occupancy_max_rows`` rows.

    Flying pixels are neither obstacles nor floor. Computed on the host.
    """
    cloud = cloud.strided(-(-cloud.depth_m.shape[0] // params.occupancy_max_rows))
    compiled = jit.usable(wanted=params.compiled, device=CPU)
    cloud = cloud.without(flying_pixels(cloud.depth_m, compiled=compiled))
    if compiled:
        return _compiled_update(cloud, params)
    depth_m, points = cloud.depth_m, cloud.points_m
    camera = cloud.camera_m.astype(np.float32)
    rays = points[::RAY_STRIDE, ::RAY_STRIDE][depth_m[::RAY_STRIDE, ::RAY_STRIDE] > 0]
    obstacles, low = _obstacles(cloud, params)
    floor = floor_points(cloud, params)
    box = _box(
        (floor.seen, floor.drops, floor.blind, obstacles, low, _cleared(camera, rays, params)),
        params.cell_size_m,
    )
    clear, blind = _marked(floor.seen, box), _marked(floor.blind, box)
    voxels = _voxel_evidence(obstacles, (camera, rays), box, params)
    lowest = voxels[..., 0]
    lowest[(_counts(low, box) >= MIN_HITS) & (lowest < LOW_HIT)] = LOW_HIT
    evidence = np.concatenate([voxels, _drop_evidence(floor.drops, clear, box)[..., None]], axis=2)
    touched = clear | blind | evidence.any(axis=2)
    cells = np.argwhere(touched) + np.asarray(box.origin_cell)
    return OccupancyUpdate.of_arrays(cells, evidence[touched], clear[touched], blind[touched])


def _compiled_update(cloud: PointCloud, params: OccupancyParams) -> OccupancyUpdate:
    """``occupancy_update`` of the thinned cloud without flying pixels, by compiled loops."""
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


def _obstacles(cloud: PointCloud, params: OccupancyParams) -> tuple[F32, F32]:
    """Points (n, 3) on obstacles, and those (m, 3) between the heights of floor and obstacles."""
    depth_m, z = cloud.depth_m, cloud.points_m[..., 2]
    error = params.height_error_per_m * depth_m
    least = params.obstacle_min_height_m + np.where(depth_m > EXACT_HEIGHT_M, error, 0.0)
    usable = (depth_m > 0) & (depth_m <= params.obstacle_range_m)
    high = usable & (z >= least) & (z < params.obstacle_max_height_m)
    low = usable & (z > params.floor_tolerance_m + error) & (z < least)
    return cloud.points_m[high], cloud.points_m[low]


def _voxel_evidence(
    obstacles: F32, rays: tuple[F32, F32], box: GridSpec, params: OccupancyParams
) -> I8:
    """Evidence (nx, ny, levels) of points on obstacles and of free space along rays.

    rays: the camera (3,) and where they end (m, 3).
    """
    hits = np.zeros((*box.shape, params.levels), np.int32)
    np.add.at(hits.reshape(-1), voxel_indices(obstacles, box, params), 1)
    crossed = np.zeros(hits.shape, bool)
    crossed.reshape(-1)[voxel_indices(ray_samples(*rays, params=params), box, params)] = True
    evidence: I8 = (crossed * np.int8(-MISS)).astype(np.int8)
    evidence[hits > 0] = SINGLE_HIT
    evidence[hits >= MIN_HITS] = HIT
    return evidence


def _cleared(camera: F32, ends: F32, params: OccupancyParams) -> F32:
    """The camera (3,), and the ends (m, 3) of rays no further than the clearing range: (m + 1, 3).

    All samples of the rays lie between them.
    """
    rays = ends - camera
    length_m = np.linalg.norm(rays, axis=1)
    share = np.minimum(params.clearing_range_m / np.maximum(length_m, 1e-6), 1.0)
    reached: F32 = camera + np.concatenate([camera[None] * 0, rays * share[:, None]])
    return reached.astype(np.float32)


def _drop_evidence(drops: F32, clear: Bool, box: GridSpec) -> I8:
    """Evidence (nx, ny) for the voxel below the floor, of places where floor is missing."""
    evidence: I8 = (clear * np.int8(-MISS)).astype(np.int8)
    evidence[_counts(drops, box) >= MIN_HITS] = DROP_HIT
    return evidence


def _counts(places: F32, box: GridSpec) -> I64:
    """How many of the places (n, 2 or 3) lie in each cell (nx, ny)."""
    counts = np.zeros(box.shape, np.int64)
    np.add.at(counts, tuple(box.cells(places[:, :2].astype(np.float64)).T), 1)
    return counts


def _marked(places: F32, box: GridSpec) -> Bool:
    """Mask (nx, ny) of the cells that hold a place."""
    mask = np.zeros(box.shape, bool)
    mask[tuple(box.cells(places.astype(np.float64)).T)] = True
    return mask


def ray_samples(camera: F32, ends: F32, *, params: OccupancyParams) -> F32:
    """Points (n, 3) in the free space between camera (3,) and surface points (m, 3).

    Within the clearing range and the heights of obstacles; not in the last cell before the
    surface, because depth noise moves the surface across cell borders.
    """
    rays = ends - camera
    length = np.linalg.norm(rays, axis=1)
    distances = ray_distances_m(params)
    rays = rays / np.maximum(length, 1e-6)[:, None]
    z = camera[2] + rays[:, 2, None] * distances
    inside = distances <= (length - params.cell_size_m)[:, None]
    inside &= (z < params.obstacle_max_height_m) & (z >= params.obstacle_min_height_m)
    samples = np.empty((np.count_nonzero(inside), 3), np.float32)
    for k in range(2):
        samples[:, k] = (camera[k] + rays[:, k, None] * distances)[inside]
    samples[:, 2] = z[inside]
    return samples


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


def voxel_indices(points: F32, box: GridSpec, params: OccupancyParams) -> I64:
    """Flat voxel indices (n,) in (nx, ny, levels) of points (n, 3) inside box and height band."""
    level = ((points[:, 2] - params.obstacle_min_height_m) / voxel_thickness_m(params)).astype(
        np.int64
    )
    cells = box.cells(points[:, :2].astype(np.float64))
    flat: I64 = (cells[:, 0] * box.shape[1] + cells[:, 1]) * params.levels
    return flat + np.minimum(level, params.levels - 1)


def _box(clouds: tuple[F32, ...], cell_size_m: float) -> GridSpec:
    # Per coordinate: a reduction along axis 0 of (n, 3) is twenty times slower.
    columns = [[cloud[:, k] for cloud in clouds if len(cloud)] for k in range(2)]
    low_x, low_y = (min(float(c.min()) for c in column) for column in columns)
    high_x, high_y = (max(float(c.max()) for c in column) for column in columns)
    return GridSpec.covering(cell_size_m, (low_x, low_y), (high_x, high_y))


def accumulated_evidence(evidence: Tensor, added: Tensor) -> Tensor:
    """The sum of evidence and added (n, levels + 1) int8, within MIN_EVIDENCE and MAX_EVIDENCE.

    What has lost its top fades, see ``with_lost_tops``.
    """
    total = evidence.short() + with_lost_tops(evidence, added)
    return total.clamp_(MIN_EVIDENCE, MAX_EVIDENCE).to(torch.int8)


def with_lost_tops(evidence: Tensor, added: Tensor) -> Tensor:
    """What is added to evidence, both (n, levels + 1) int8, where a thing has lost its top.

    A camera does not see the floor at its feet: when somebody who stood there has gone, its rays
    pass through the upper voxels only. So in a column that no point lies in, voxels with evidence
    that no ray met lose as much as those with evidence above them that were seen through. A chair
    before which the camera looks over the seat loses none, because nothing stood above it.
    """
    column, seen = evidence[:, :-1], added[:, :-1]
    lost = torch.where(column > 0, seen, torch.zeros_like(seen)).clamp_max(0)
    above = lost.flip(1).cummin(dim=1).values.flip(1)  # the most that any voxel from here up lost
    hidden = (column > 0) & (seen == 0) & (seen <= 0).all(dim=1, keepdim=True)
    return torch.cat([torch.where(hidden, above, seen), added[:, -1:]], dim=1)


def unseen_gone(before: Tensor, added: Tensor, after: Tensor) -> Tensor:
    """Mask (n,): an obstacle went that no ray went through, see ``with_lost_tops``.

    Evidence (n, levels + 1) before and after, and what a frame added. The lower part of somebody
    who has gone, or of a chest that they stood beside, in whose cell they were as well.
    """
    gone = (before >= OCCUPIED_THRESHOLD) & (after < OCCUPIED_THRESHOLD)
    return (gone & (added == 0))[:, :-1].any(dim=1)


def occupancy_states(evidence: Tensor, clear: Tensor) -> Tensor:
    """Values of ``Occupancy`` (n,) uint8 from evidence (n, levels + 1) and clear (n,)."""
    states = torch.full_like(clear, int(Occupancy.UNKNOWN), dtype=torch.uint8)
    states.masked_fill_(clear, int(Occupancy.FREE))
    occupied = evidence.amax(dim=1) >= OCCUPIED_THRESHOLD
    return states.masked_fill_(occupied, int(Occupancy.OCCUPIED))


def settled_states(before: Tensor, evidence: Tensor, states: Tensor) -> Tensor:
    """What of ``Occupancy`` (n,) cells have lasted in, from what they had before.

    A cell is free as soon as its state is; what stands in it is taken for lasting once its
    evidence (n, levels + 1) has grown to ``SETTLED_EVIDENCE``: somebody who walks by leaves sooner.
    """
    after = before.masked_fill(states == Occupancy.FREE, int(Occupancy.FREE))
    lasting = evidence.amax(dim=1) >= SETTLED_EVIDENCE
    return after.masked_fill_(lasting, int(Occupancy.OCCUPIED))


def cells_within(centre_m: F64, radius_m: float, cell_size_m: float) -> I64:
    """World cells (n, 2) whose centre lies within ``radius_m`` of a point (x, y, ...)."""
    x, y = float(centre_m[0]), float(centre_m[1])
    box = GridSpec.covering(cell_size_m, (x - radius_m, y - radius_m), (x + radius_m, y + radius_m))
    cells = np.argwhere(np.ones(box.shape, bool))
    inside = np.linalg.norm(box.centres(cells) - (x, y), axis=1) <= radius_m
    chosen: I64 = cells[inside] + np.asarray(box.origin_cell)
    return chosen
