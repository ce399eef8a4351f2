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
from math import ceil

import numpy as np

from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.params import MapParams
from onemap_shared.geometry import F32, I64, Bool
from onemap_shared.jit import compiled

# Heights above z = 0, and ranges of z-depth from the camera, metres.
FLOOR_TOLERANCE_M = 0.08  # points this near to z = 0 are floor or carpet
HEIGHT_ERROR_PER_M = 0.01  # half a degree of pitch error must not raise a far floor
# A surface this much lower than the floor before it is a drop; lower thresholds are driven over.
DROP_MIN_DEPTH_M = 0.06
DROP_RANGE_M = 4.0  # to where floor is missing; further edges are found from nearer
# To where floor shows that none is missing in its cell: farther, the image samples what is below
# the rest of the cell too sparsely, and looks from afar would open an edge that was seen.
NO_DROP_RANGE_M = 3.0
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


@compiled
def blind_places(x: F32, y: F32, floor: Bool, camera: F32, shares: F32) -> F32:
    """Places (n, 2) from the camera's foot to the floor at the lower edge of the image.

    Only where the lower edge shows floor to both sides too: beside a hole there is an edge. At
    shares (k,) of the way; x, y: from the camera (3,).
    """
    columns, last = floor.shape[1], len(floor) - 1
    side = columns // BLIND_SIDE
    places = np.empty((columns * len(shares), 2), np.float32)
    filled = 0
    for j in range(columns):
        seen = True
        for beside in range(max(j - side, 0), min(j + side + 1, columns)):
            seen &= floor[last, beside]
        if seen:
            for share in shares:
                places[filled, 0] = x[last, j] * share + camera[0]
                places[filled, 1] = y[last, j] * share + camera[1]
                filled += 1
    return places[:filled]


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
    """Planes (rows, columns) float32 of a cloud: depth, x and y from the camera (3,), and height,
    metres."""

    depth: F32
    x: F32
    y: F32
    z: F32
    camera: F32

    @classmethod
    def of(cls, cloud: PointCloud) -> _Image:
        step = max(1, cloud.depth_m.shape[1] // COLUMNS)
        depth, x, y, z = (np.ascontiguousarray(plane[:, ::step]) for plane in cloud.planes)
        return cls(depth, x - cloud.camera_m[0], y - cloud.camera_m[1], z, cloud.camera_m)

    @property
    def valid(self) -> Bool:
        """Mask (rows, columns) of pixels with depth."""
        return self.depth > 0

    def xy(self, row: I64, column: I64) -> F32:
        """(n, 2): ground positions from the camera of pixels."""
        return np.stack([self.x[row, column], self.y[row, column]], axis=-1)

    def in_map(self, xy: F32) -> F32:
        """Places (..., 2) in the map frame of ground positions from the camera."""
        places: F32 = xy + self.camera[:2]
        return places


def floor_points(cloud: PointCloud, params: MapParams) -> FloorPoints:
    """The floor and the drops that one depth image shows."""
    image = _Image.of(cloud)
    floor, edge = floor_and_edges(image.depth, image.z, np.float32(params.occupancy_range_m))
    drops = [np.zeros((0, 2), np.float32)]
    below = image.valid & (image.z < -DROP_MIN_DEPTH_M / 2)
    if below.any():  # else there is neither an edge nor a riser
        feet = _riser_feet(image, below)
        floor &= feet == 0
        low = image.z < -(DROP_MIN_DEPTH_M + TILT_ERROR_PER_M * image.depth)
        before = np.concatenate([image.z[JUMP_ROWS:], image.z[-JUMP_ROWS:]])  # an edge's height
        drops += [
            _crossings(image, edge, before),
            _crossings(image, image.valid & low, np.zeros_like(image.z)),
            _before_risers(image, feet),
        ]
    if not image.valid.all():
        drops += _missing(image, floor, params.cell_size_m)
    count = ceil(FLOOR_GAP_M / params.cell_size_m)
    between = (np.arange(1, count) / count).astype(np.float32)
    narrow = np.float32(params.cell_size_m)
    seen = seen_places(image.x, image.y, floor, image.camera, between, narrow)
    blind = blind_places(image.x, image.y, floor, image.camera, _shares(BLIND_SAMPLES))
    return FloorPoints(seen, np.concatenate(drops), blind)


def _riser_feet(image: _Image, low: Bool) -> I64:
    """(rows, columns): how many rows below a riser's pixel there is one at its foot; 0: no riser.

    low: pixels below the floor, at least one.
    A riser is the upper part of a wall below the floor, and the rim above it. What goes on to rise
    is the foot of something that stands on floor which an error of the pitch lowers.
    """
    window = max(2, len(low) // RISER_ROWS)
    feet = np.zeros(low.shape, np.int64)
    if len(low) <= window:
        return feet
    columns = np.flatnonzero(low.any(axis=0))
    depth, x, y, z = (plane[:, columns] for plane in (image.depth, image.x, image.y, image.z))
    valid, low, found = depth > 0, low[:, columns], feet[:, columns]
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
    dx, dy, rise = (plane[:-rows] - plane[rows:] for plane in (x, y, z))
    steep: Bool = (rise > 0) & (RISER_SLOPE**2 * (dx * dx + dy * dy) <= rise * rise)
    return steep


def _before_risers(image: _Image, feet: I64) -> F32:
    """Places (n, 2) before risers: from where the ray to the foot crosses the height of the top."""
    row, column = np.nonzero(feet)
    foot = row + feet[row, column]
    scale = _crossing(image, image.z[row, column], image.z[foot, column])
    foot_xy = image.xy(foot, column) * scale[:, None]
    return _along(image, foot_xy, image.xy(row, column), _shares(RISER_SAMPLES))


def _crossing(image: _Image, height_m: F32, z: F32) -> F32:
    """At which share (n,) of the way to points of height z (n,) rays cross a height (n,)."""
    down = np.maximum(image.camera[2] - z, np.float32(1e-3))
    share: F32 = (image.camera[2] - height_m) / down
    return share


def _crossings(image: _Image, chosen: Bool, height_m: F32) -> F32:
    """Where the rays to chosen pixels cross a height (rows, columns)."""
    at = np.nonzero(chosen)
    share = _crossing(image, height_m[at], image.z[at])
    near = (share > 0) & (share * image.depth[at] <= DROP_RANGE_M)
    return image.in_map(image.xy(*at) * share[:, None])[near]


def _missing(image: _Image, floor: Bool, cell_size_m: float) -> list[F32]:
    """Places just beyond floor that ends at a large hole without returns, and across the hole.

    Beyond it is a cell further, away from the camera or sideways.
    """
    valid, (rows, columns) = image.valid, floor.shape
    tall, wide = max(2, rows // MISSING_ROWS), max(1, columns // MISSING_COLUMNS)
    count = np.zeros((rows + 1, columns + 1), np.int32)
    count[1:, 1:] = (~valid).cumsum(axis=0, dtype=np.int32).cumsum(axis=1, dtype=np.int32)
    near = floor & (image.depth <= MISSING_FLOOR_RANGE_M)
    beside = np.stack([valid[:-2, 1:-1], valid[1:-1, :-2], valid[1:-1, 2:]])
    side, row, column = np.nonzero(near[1:-1, 1:-1] & ~beside)
    row, column, up = row + 1, column + 1, side == 0  # the others: to the left and to the right
    right = np.where(up, 0, 2 * side - 3)
    top = np.maximum(row - tall, 0)
    left = np.maximum(column + np.where(up, -wide // 2, right * wide), 0)
    left = np.minimum(left, column + right)
    bottom, end = np.minimum(top + tall, rows), np.minimum(left + wide, columns)
    missing = count[bottom, end] - count[top, end] - count[bottom, left] + count[top, left]
    large = missing >= MISSING_SHARE * tall * wide
    row, column, up, right = (each[large] for each in (row, column, up, right))
    xy = image.xy(row, column)
    distance = np.sqrt(xy[:, 0] * xy[:, 0] + xy[:, 1] * xy[:, 1])
    ahead = xy / np.maximum(distance, np.float32(1e-3))[:, None]
    aside = np.stack([ahead[:, 1], -ahead[:, 0]], axis=1) * right[:, None].astype(np.float32)
    way = np.float32(cell_size_m) * np.where(up[:, None], ahead, aside)
    return [image.in_map(xy + way), _across(image, row[up], column[up], floor)]


def _across(image: _Image, row: I64, column: I64, floor: Bool) -> F32:
    """Places between pixels and the next return above them, where that is floor."""
    rows = np.arange(len(floor))[:, None]
    far = np.maximum.accumulate(np.where(image.valid, rows, -1), axis=0)[row - 1, column]
    there = (far >= 0) & floor[far, column]
    row, column, far = row[there], column[there], far[there]
    shares = _shares(ACROSS_SAMPLES, first=0.5)
    return _along(image, image.xy(row, column), image.xy(far, column), shares)


def _along(image: _Image, start: F32, end: F32, shares: F32) -> F32:
    """Places (n * k, 2) in the map at shares (k,) of the way, of positions (n, 2)."""
    places = start[:, None] + (end - start)[:, None] * shares[:, None]
    return image.in_map(places.reshape(-1, 2))


def _shares(count: int, first: float = 0.0) -> F32:
    """first, first + 1, ... (count,) float32, divided by ``count``."""
    numbers: F32 = np.arange(count, dtype=np.float32) + np.float32(first)
    numbers /= np.float32(count)
    return numbers
