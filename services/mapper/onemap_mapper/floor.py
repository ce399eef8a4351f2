"""Floor and drops in a depth image: where floor was seen, and where it is missing.

The image is read by columns, from the bottom up: along a column the floor recedes. Between two
neighbouring pixels of a column a step down shows as a jump of the height, which an error of the
camera's pitch hardly changes, because it moves both. So the edge of a step is found by the jump,
and by the absolute height only what lies lower than such an error can explain. A ray that reaches
a point below the floor crossed the floor's height where there is no floor: that place is a drop.
On the far side of an opening the wall below its edge is steep, which tells it from floor that an
error of the pitch lowers; its upper part is no lower than such an error explains.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_mapper.kernels import jit
from onemap_mapper.kernels.floor_pixels import floor_and_edges, image_planes, seen_places
from onemap_mapper.params import OccupancyParams
from onemap_mapper.point_cloud import PointCloud
from onemap_mapper.transfers import CPU
from onemap_shared.geometry import F32, I64, Bool

COLUMNS = 160  # of the image that are read: at 5 m still 5 cm apart
JUMP_ROWS = 2  # rows between the pixels compared: a depth edge smears over one or two
MISSING_ROWS = 15  # a hole without return is this part of the image's height, or larger,
MISSING_COLUMNS = 20  # and this part of its width: smaller ones are noise or a stereo shadow
MISSING_SHARE = 0.9  # of a hole's pixels that have no return
BLIND_SIDE = 8  # part of the image's width to each side that must show floor as well
ACROSS_SAMPLES = 24  # between the floor on both sides of a hole
BLIND_SAMPLES = 24  # between the camera's foot and the nearest floor in view
RISER_ROWS = 24  # from the top of a wall below floor to its foot this part of the image, or fewer
RISER_SLOPE = 2.0  # rise over run, at least: noise of the depth tilts a wall
RISER_SAMPLES = 4  # between the place where a ray crossed the floor's height and the wall


@dataclass(frozen=True, slots=True)
class FloorPoints:
    """Places (n, 2) float32 in metres: ``seen`` floor, ``drops`` where floor is missing.

    ``blind``: between the camera and the nearest floor in view, so most likely floor too.
    """

    seen: F32
    drops: F32
    blind: F32


@dataclass(frozen=True, slots=True)
class _Image:
    """Planes (rows, columns) of a cloud: depth, x and y from the camera, and height, metres."""

    depth: F32
    x: F32
    y: F32
    z: F32
    camera: F32

    @classmethod
    def of(cls, cloud: PointCloud, *, compiled: bool) -> _Image:
        step = max(1, cloud.depth_m.shape[1] // COLUMNS)
        camera = cloud.camera_m.astype(np.float32)
        if compiled:
            depth = np.ascontiguousarray(cloud.depth_m)
            depth, x, y, z = image_planes(depth, cloud.points_m, camera, step)
            return cls(depth, x, y, z, camera)
        depth, points = cloud.depth_m[:, ::step], cloud.points_m[:, ::step]
        x, y, z = (np.ascontiguousarray(points[..., k]) for k in range(3))
        return cls(np.ascontiguousarray(depth), x - camera[0], y - camera[1], z, camera)

    def places(self, chosen: Bool, scale: F32 | float = 1.0) -> F32:
        """(n, 2): ground positions of chosen pixels, their distance from the camera scaled."""
        xy = np.stack([self.x[chosen] * scale, self.y[chosen] * scale], axis=1)
        places: F32 = (xy + self.camera[:2]).astype(np.float32)
        return places


def floor_points(cloud: PointCloud, params: OccupancyParams) -> FloorPoints:
    """The floor and the drops that one depth image shows."""
    compiled = jit.usable(wanted=params.compiled, device=CPU)
    image = _Image.of(cloud, compiled=compiled)
    valid = image.depth > 0
    floor, edge = (_by_loops if compiled else _floor_and_edges)(image, params)
    feet = _riser_feet(image, valid, params)
    floor &= feet == 0
    drops = [
        _crossings(image, edge, params, height_m=_below(image.z, JUMP_ROWS)),
        _crossings(image, valid & _is_low(image, params), params),
        _before_risers(image, feet),
        _missing(image, valid, floor, params),
    ]
    if compiled:
        seen = seen_places(image.x, image.y, floor, image.camera, _gaps(params))
    else:
        seen = np.concatenate([image.places(floor), *_between(image, floor, params)])
    return FloorPoints(seen, np.concatenate(drops), _blind(image, floor))


def _floor_and_edges(image: _Image, params: OccupancyParams) -> tuple[Bool, Bool]:
    """Pixels (rows, columns) of floor, and those just beyond the edge of a step down."""
    valid = image.depth > 0
    slack = params.height_error_per_m * image.depth
    fall = params.drop_min_depth_m + slack
    edge = _edges(image, valid, fall, params)
    floor = valid & (image.z <= params.floor_tolerance_m + slack) & (image.z >= -fall)
    floor &= image.depth <= params.occupancy_range_m
    floor &= ~_behind_edge(image, edge)
    return floor, edge


def _by_loops(image: _Image, params: OccupancyParams) -> tuple[Bool, Bool]:
    """``_floor_and_edges``, compiled."""
    limits = (
        params.height_error_per_m,
        params.tilt_error_per_m,
        params.drop_min_depth_m,
        params.floor_tolerance_m,
        params.occupancy_range_m,
    )
    return floor_and_edges(image.depth, image.z, JUMP_ROWS, np.array(limits, np.float32))


def _below(values: F32, rows: int) -> F32:
    """The values (rows, columns) this many rows lower in the image; the last rows repeat."""
    shifted: F32 = np.concatenate([values[rows:], values[-rows:]])
    return shifted


def _is_low(image: _Image, params: OccupancyParams) -> Bool:
    """Pixels lower than an error of the camera's pitch explains."""
    low: Bool = image.z < -(params.drop_min_depth_m + params.tilt_error_per_m * image.depth)
    return low


def _edges(image: _Image, valid: Bool, fall: F32, params: OccupancyParams) -> Bool:
    """Pixels just beyond the edge of a step down: floor in the image below them, and they fall."""
    near, far = slice(JUMP_ROWS, None), slice(None, -JUMP_ROWS)
    z = image.z
    reach = params.floor_tolerance_m + params.tilt_error_per_m * image.depth[near]
    edge = np.zeros(valid.shape, bool)
    edge[far] = valid[near] & valid[far] & (np.abs(z[near]) <= reach)
    edge[far] &= (z[near] - z[far] > fall[near]) & (z[far] < -params.drop_min_depth_m / 2)
    return edge


def _behind_edge(image: _Image, edge: Bool) -> Bool:
    """Pixels above an edge in their column that lie lower than half its height."""
    if not edge.any():
        return np.zeros(edge.shape, bool)
    rows, columns = edge.shape
    none = rows - 1
    row = np.where(edge, np.arange(rows, dtype=np.int32)[:, None], none)
    nearest = np.minimum.accumulate(row[::-1], axis=0)[::-1]
    before, column = np.minimum(nearest + JUMP_ROWS, none), np.arange(columns)
    middle = (image.z[before, column] + image.z[nearest, column]) / 2
    behind: Bool = (nearest < none) & (image.z < middle)
    return behind


def _riser_feet(image: _Image, valid: Bool, params: OccupancyParams) -> I64:
    """(rows, columns): how many rows below a riser's pixel there is one at its foot; 0: no riser.

    A riser is the upper part of a wall below the floor, and the rim above it. What goes on to rise
    is the foot of something that stands on floor which an error of the pitch lowers.
    """
    rows = len(valid)
    window = max(2, rows // RISER_ROWS)
    feet = np.zeros(valid.shape, np.int64)
    low = valid & (image.z < -params.drop_min_depth_m / 2)
    columns = np.flatnonzero(low.any(axis=0))
    if rows <= window or len(columns) == 0:
        return feet
    depth, x, y, z = (plane[:, columns] for plane in (image.depth, image.x, image.y, image.z))
    valid, low, found = valid[:, columns], low[:, columns], feet[:, columns]
    fall = params.drop_min_depth_m + params.height_error_per_m * depth
    top = valid & (np.abs(z) <= params.floor_tolerance_m + params.tilt_error_per_m * depth)
    top &= depth <= params.drop_range_m
    top[:window] = False
    top[window:] &= valid[:-window] & ~_is_steep(x, y, z, window)
    for k in range(1, window + 1):
        upper, lower = slice(None, -k), slice(k, None)
        there = top[upper] & low[lower] & (found[upper] == 0)
        there &= (z[upper] - z[lower] > fall[upper]) & _is_steep(x, y, z, k)
        found[upper][there] = k
    feet[:, columns] = found
    return feet


def _is_steep(x: F32, y: F32, z: F32, rows: int) -> Bool:
    """Whether it rises steeply from each pixel but the first ``rows`` to the one so far above."""
    rise = z[:-rows] - z[rows:]
    dx, dy = x[:-rows] - x[rows:], y[:-rows] - y[rows:]
    steep: Bool = (rise > 0) & (RISER_SLOPE**2 * (dx * dx + dy * dy) <= rise * rise)
    return steep


def _before_risers(image: _Image, feet: I64) -> F32:
    """Places (n, 2) before risers: from where the ray to the foot crosses the height of the top."""
    row, column = np.nonzero(feet)
    foot = row + feet[row, column]
    camera_m, top_m, foot_m = image.camera[2], image.z[row, column], image.z[foot, column]
    scale = (camera_m - top_m) / np.maximum(camera_m - foot_m, 1e-3)
    top_xy = np.stack([image.x[row, column], image.y[row, column]], axis=1)
    foot_xy = np.stack([image.x[foot, column], image.y[foot, column]], axis=1) * scale[:, None]
    share = np.arange(RISER_SAMPLES, dtype=np.float32) / np.float32(RISER_SAMPLES)
    places = foot_xy[:, None] + (top_xy - foot_xy)[:, None] * share[:, None] + image.camera[:2]
    return np.asarray(places.reshape(-1, 2), np.float32)


def _crossings(
    image: _Image, chosen: Bool, params: OccupancyParams, *, height_m: F32 | None = None
) -> F32:
    """Where the rays to chosen pixels cross a height (rows, columns), by default z = 0."""
    level = np.float32(0.0) if height_m is None else height_m[chosen]
    if not chosen.any():
        return np.zeros((0, 2), np.float32)
    above = image.camera[2] - level
    scale = above / np.maximum(image.camera[2] - image.z[chosen], 1e-3)
    near = (scale > 0) & (scale * image.depth[chosen] <= params.drop_range_m)
    places: F32 = image.places(chosen, scale)[near]
    return places


def _missing(image: _Image, valid: Bool, floor: Bool, params: OccupancyParams) -> F32:
    """Places just beyond floor that ends at a large hole without returns, and across the hole."""
    rows, columns = valid.shape
    tall, wide = max(2, rows // MISSING_ROWS), max(1, columns // MISSING_COLUMNS)
    if valid.all():
        return np.zeros((0, 2), np.float32)
    near = floor & (image.depth <= params.missing_floor_range_m)
    count = np.zeros((rows + 1, columns + 1), np.int32)
    np.cumsum(np.cumsum(~valid, axis=0, dtype=np.int32), axis=1, out=count[1:, 1:])
    places = []
    for step in (-1, 0), (0, -1), (0, 1):  # to the pixel that is missing: row, column
        at = np.argwhere(near[1:-1, 1:-1] & ~_shifted(valid, step)) + 1
        low = np.maximum(at + np.array([-tall, -wide // 2 if step[1] == 0 else step[1] * wide]), 0)
        low[:, 1] = np.minimum(low[:, 1], at[:, 1] + step[1])
        high = np.minimum(low + (tall, wide), valid.shape)
        i, j, k, m = low[:, 0], low[:, 1], high[:, 0], high[:, 1]
        missing = count[k, m] - count[i, m] - count[k, j] + count[i, j]
        at = at[missing >= MISSING_SHARE * tall * wide]
        places.append(_beyond(image, at, step, params.cell_size_m))
        if step == (-1, 0):
            places.append(_across(image, at, valid, floor))
    return np.concatenate(places)


def _shifted(valid: Bool, step: tuple[int, int]) -> Bool:
    """``valid`` of the neighbour at ``step``, for the pixels that are not on the image's edge."""
    rows, columns = valid.shape
    return valid[1 + step[0] : rows - 1 + step[0], 1 + step[1] : columns - 1 + step[1]]


def _beyond(image: _Image, at: I64, step: tuple[int, int], cell_size_m: float) -> F32:
    """Places (n, 2) one cell from the pixels ``at`` (n, 2), away from the camera or sideways."""
    rows, columns = at.T
    xy = np.stack([image.x[rows, columns], image.y[rows, columns]], axis=1)
    ahead = xy / np.maximum(np.linalg.norm(xy, axis=1, keepdims=True), 1e-3)
    right = np.stack([ahead[:, 1], -ahead[:, 0]], axis=1)
    places = xy + cell_size_m * (ahead if step[0] else step[1] * right) + image.camera[:2]
    return np.asarray(places, np.float32)


def _across(image: _Image, at: I64, valid: Bool, floor: Bool) -> F32:
    """Places between pixels ``at`` (n, 2) and the next return above them, where that is floor."""
    rows = np.arange(len(valid), dtype=np.int32)[:, None]
    last = np.maximum.accumulate(np.where(valid, rows, -1), axis=0)
    row, column = at.T
    far = last[row - 1, column]
    row, column, far = (v[(far >= 0) & floor[far, column]] for v in (row, column, far))
    near_xy = np.stack([image.x[row, column], image.y[row, column]], axis=1)
    far_xy = np.stack([image.x[far, column], image.y[far, column]], axis=1)
    share = (np.arange(ACROSS_SAMPLES, dtype=np.float32) + 0.5) / np.float32(ACROSS_SAMPLES)
    places = near_xy[:, None] + (far_xy - near_xy)[:, None] * share[:, None] + image.camera[:2]
    return np.asarray(places.reshape(-1, 2), np.float32)


def _between(image: _Image, floor: Bool, params: OccupancyParams) -> list[F32]:
    """Places between floor pixels that are neighbours in a column but cells apart."""
    both = floor[:-1] & floor[1:]
    dx, dy = np.diff(image.x, axis=0)[both], np.diff(image.y, axis=0)[both]
    gap_m = np.hypot(dx, dy)
    wide = (gap_m > params.cell_size_m) & (gap_m <= params.floor_gap_m)
    step = np.stack([dx, dy], axis=1)[wide]
    upper = np.stack([image.x[:-1][both], image.y[:-1][both]], axis=1)[wide] + image.camera[:2]
    return [upper + step * share for share in _gaps(params)[:-2]]


def _gaps(params: OccupancyParams) -> F32:
    """Shares of the way across a gap (n,), then the narrowest and the widest gap in metres."""
    count = int(np.ceil(params.floor_gap_m / params.cell_size_m))
    shares = [k / count for k in range(1, count)]
    return np.array([*shares, params.cell_size_m, params.floor_gap_m], np.float32)


def _blind(image: _Image, floor: Bool) -> F32:
    """Places from the camera's foot to the floor at the lower edge of the image.

    Only where the lower edge shows floor to both sides too: beside a hole there is an edge.
    """
    side = floor.shape[1] // BLIND_SIDE
    others = np.convolve(~floor[-1], np.ones(2 * side + 1, np.int32), mode="same")
    nearest = others == 0
    share = np.arange(BLIND_SAMPLES, dtype=np.float32) / np.float32(BLIND_SAMPLES)
    places = np.empty((np.count_nonzero(nearest), BLIND_SAMPLES, 2), np.float32)
    for k, plane in enumerate((image.x, image.y)):
        places[..., k] = plane[-1][nearest, None] * share + image.camera[k]
    return places.reshape(-1, 2)
