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

from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.jit import compiled
from onemap_mapper.params import MapParams
from onemap_shared.geometry import F32, I64, Bool

# Heights above z = 0, and ranges of z-depth from the camera, metres.
FLOOR_TOLERANCE_M = 0.08  # points this near to z = 0 are floor or carpet
HEIGHT_ERROR_PER_M = 0.01  # half a degree of pitch error must not raise a far floor
# A surface this much lower than the floor before it is a drop; lower thresholds are driven over.
DROP_MIN_DEPTH_M = 0.06
DROP_RANGE_M = 4.0  # to where floor is missing; further edges are found from nearer
# Where seen floor ends nearer than this at a large hole without depth, as at the top of stairs, its
# end is an edge.
MISSING_FLOOR_RANGE_M = 3.0
# Of height per metre of distance, 2 degrees, that an error of the pitch explains: lower things are
# drops even if the edge before them was not in view; so is a ramp that falls more steeply.
TILT_ERROR_PER_M = 0.035
# Floor between two points of it that are neighbours in the image counts as seen: at a grazing angle
# the image samples the floor sparsely.
FLOOR_GAP_M = 0.4

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


@compiled
def image_planes(depth_m: F32, points_m: F32, camera: F32, step: int) -> F32:
    """Planes (4, rows, columns) of every so manieth column, metres.

    Depth, x and y from the camera (3,), and height.
    """
    rows, width = depth_m.shape
    planes = np.empty((4, rows, -(-width // step)), np.float32)
    for i in range(rows):
        for j in range(planes.shape[2]):
            planes[0, i, j] = depth_m[i, j * step]
            planes[1, i, j] = points_m[i, j * step, 0] - camera[0]
            planes[2, i, j] = points_m[i, j * step, 1] - camera[1]
            planes[3, i, j] = points_m[i, j * step, 2]
    return planes


@compiled
def floor_and_edges(depth: F32, z: F32, farthest: np.float32) -> tuple[Bool, Bool]:
    """Pixels (rows, columns) of floor up to a depth, and those just beyond the edge of a step down.

    Floor behind an edge, above it in its column, is none where it lies lower than half its height.
    """
    error_per_m, tilt_per_m = np.float32(HEIGHT_ERROR_PER_M), np.float32(TILT_ERROR_PER_M)
    drop, tolerance = np.float32(DROP_MIN_DEPTH_M), np.float32(FLOOR_TOLERANCE_M)
    rows, columns = depth.shape
    none = rows - 1
    floor, edge = np.zeros((rows, columns), np.bool_), np.zeros((rows, columns), np.bool_)
    nearest = np.full(columns, none, np.int64)  # row of the edge in the image below
    edges = False
    for i in range(rows - 1, -1, -1):
        d, far, falls, even = depth[i], z[i], edge[i], floor[i]
        if i + JUMP_ROWS < rows:
            below, near = depth[i + JUMP_ROWS], z[i + JUMP_ROWS]
            for j in range(columns):
                least = drop + error_per_m * below[j]
                step = (near[j] - far[j] > least) & (far[j] < -drop / np.float32(2))
                reach = tolerance + tilt_per_m * below[j]
                falls[j] = step & (abs(near[j]) <= reach) & (below[j] > 0) & (d[j] > 0)
        for j in range(columns):
            slack = error_per_m * d[j]
            level = (far[j] <= tolerance + slack) & (far[j] >= -(drop + slack))
            even[j] = level & (d[j] > 0) & (d[j] <= farthest)
            edges |= falls[j]
        if not edges:
            continue
        for j in range(columns):
            nearest[j] = i if falls[j] else nearest[j]
            at = nearest[j]
            middle = (z[min(at + JUMP_ROWS, none), j] + z[at, j]) / np.float32(2)
            even[j] &= not ((at < none) & (far[j] < middle))
    return floor, edge


@compiled
def seen_places(  # noqa: PLR0917
    x: F32, y: F32, floor: Bool, camera: F32, shares: F32, narrow: np.float32
) -> F32:
    """Places (n, 2) of floor pixels (rows, columns), then between those that are cells apart.

    x, y: from the camera (3,). Between neighbours in a column, ``narrow`` or more metres apart,
    floor is at these shares of the way.
    """
    wide = np.float32(FLOOR_GAP_M)
    rows, columns = floor.shape
    wide_at = np.empty(rows * columns, np.int64)
    count = gap_count = 0
    for i in range(rows):
        for j in range(columns):
            count += floor[i, j]
            if i + 1 < rows and floor[i, j] and floor[i + 1, j]:
                dx = np.float64(x[i + 1, j] - x[i, j])
                dy = np.float64(y[i + 1, j] - y[i, j])
                gap = np.float32(np.sqrt(dx * dx + dy * dy))
                if gap > narrow and gap <= wide:
                    wide_at[gap_count] = i * columns + j
                    gap_count += 1
    places = np.empty((count + gap_count * len(shares), 2), np.float32)
    filled = 0
    for i in range(rows):
        for j in range(columns):
            if floor[i, j]:
                places[filled, 0], places[filled, 1] = x[i, j] + camera[0], y[i, j] + camera[1]
                filled += 1
    for share in shares:
        for k in range(gap_count):
            i, j = wide_at[k] // columns, wide_at[k] % columns
            dx, dy = x[i + 1, j] - x[i, j], y[i + 1, j] - y[i, j]
            places[filled, 0] = x[i, j] + camera[0] + dx * share
            places[filled, 1] = y[i, j] + camera[1] + dy * share
            filled += 1
    return places


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
    def of(cls, cloud: PointCloud) -> _Image:
        step = max(1, cloud.depth_m.shape[1] // COLUMNS)
        camera = cloud.camera_m.astype(np.float32)
        depth = np.ascontiguousarray(cloud.depth_m)
        depth, x, y, z = image_planes(depth, cloud.points_m, camera, step)
        return cls(depth, x, y, z, camera)

    def places(self, chosen: Bool, scale: F32 | float = 1.0) -> F32:
        """(n, 2): ground positions of chosen pixels, their distance from the camera scaled."""
        xy = np.stack([self.x[chosen] * scale, self.y[chosen] * scale], axis=1)
        places: F32 = (xy + self.camera[:2]).astype(np.float32)
        return places


def floor_points(cloud: PointCloud, params: MapParams) -> FloorPoints:
    """The floor and the drops that one depth image shows."""
    image = _Image.of(cloud)
    valid = image.depth > 0
    floor, edge = floor_and_edges(image.depth, image.z, np.float32(params.occupancy_range_m))
    feet = _riser_feet(image, valid)
    floor &= feet == 0
    drops = [
        _crossings(image, edge, height_m=_below(image.z, JUMP_ROWS)),
        _crossings(image, valid & _is_low(image)),
        _before_risers(image, feet),
        _missing(image, valid, floor, params.cell_size_m),
    ]
    count = int(np.ceil(FLOOR_GAP_M / params.cell_size_m))
    shares = np.array([k / count for k in range(1, count)], np.float32)
    narrow = np.float32(params.cell_size_m)
    seen = seen_places(image.x, image.y, floor, image.camera, shares, narrow)
    return FloorPoints(seen, np.concatenate(drops), _blind(image, floor))


def _below(values: F32, rows: int) -> F32:
    """The values (rows, columns) this many rows lower in the image; the last rows repeat."""
    shifted: F32 = np.concatenate([values[rows:], values[-rows:]])
    return shifted


def _is_low(image: _Image) -> Bool:
    """Pixels lower than an error of the camera's pitch explains."""
    low: Bool = image.z < -(DROP_MIN_DEPTH_M + TILT_ERROR_PER_M * image.depth)
    return low


def _riser_feet(image: _Image, valid: Bool) -> I64:
    """(rows, columns): how many rows below a riser's pixel there is one at its foot; 0: no riser.

    A riser is the upper part of a wall below the floor, and the rim above it. What goes on to rise
    is the foot of something that stands on floor which an error of the pitch lowers.
    """
    rows = len(valid)
    window = max(2, rows // RISER_ROWS)
    feet = np.zeros(valid.shape, np.int64)
    low = valid & (image.z < -DROP_MIN_DEPTH_M / 2)
    columns = np.flatnonzero(low.any(axis=0))
    if rows <= window or len(columns) == 0:
        return feet
    depth, x, y, z = (plane[:, columns] for plane in (image.depth, image.x, image.y, image.z))
    valid, low, found = valid[:, columns], low[:, columns], feet[:, columns]
    fall = DROP_MIN_DEPTH_M + HEIGHT_ERROR_PER_M * depth
    top = valid & (np.abs(z) <= FLOOR_TOLERANCE_M + TILT_ERROR_PER_M * depth)
    top &= depth <= DROP_RANGE_M
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


def _crossings(image: _Image, chosen: Bool, *, height_m: F32 | None = None) -> F32:
    """Where the rays to chosen pixels cross a height (rows, columns), by default z = 0."""
    level = np.float32(0.0) if height_m is None else height_m[chosen]
    if not chosen.any():
        return np.zeros((0, 2), np.float32)
    above = image.camera[2] - level
    scale = above / np.maximum(image.camera[2] - image.z[chosen], 1e-3)
    near = (scale > 0) & (scale * image.depth[chosen] <= DROP_RANGE_M)
    places: F32 = image.places(chosen, scale)[near]
    return places


def _missing(image: _Image, valid: Bool, floor: Bool, cell_size_m: float) -> F32:
    """Places just beyond floor that ends at a large hole without returns, and across the hole."""
    rows, columns = valid.shape
    tall, wide = max(2, rows // MISSING_ROWS), max(1, columns // MISSING_COLUMNS)
    if valid.all():
        return np.zeros((0, 2), np.float32)
    near = floor & (image.depth <= MISSING_FLOOR_RANGE_M)
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
        places.append(_beyond(image, at, step, cell_size_m))
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
