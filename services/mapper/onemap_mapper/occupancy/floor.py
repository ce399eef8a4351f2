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
import torch
from torch import Tensor

from onemap_mapper import jit
from onemap_mapper.frame.cloud import PointCloud, divided, lengths
from onemap_mapper.jit import compiled
from onemap_mapper.params import MapParams
from onemap_shared.geometry import F32, F64, Bool

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
def columns_seen(planes: tuple[F32, F32, F32, F32], step: int, camera: F32) -> F32:
    """The planes (4, rows, columns) of ``_Image``, of every so manieth column."""
    rows, columns = planes[0].shape[0], -(-planes[0].shape[1] // step)
    seen = np.empty((4, rows, columns), np.float32)
    for k, plane in enumerate(planes):
        less = camera[k - 1] if k in {1, 2} else np.float32(0)
        for i in range(rows):
            for j in range(columns):
                seen[k, i, j] = plane[i, j * step] - less
    return seen


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
    """Places (n, 2) as ``_blind``, at shares (k,) of the way; x, y: from the camera (3,)."""
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
    camera: Tensor  # (3,)

    @classmethod
    def of(cls, cloud: PointCloud, *, by_loops: bool) -> _Image:
        step = max(1, cloud.depth_m.shape[1] // COLUMNS)
        camera = torch.tensor(cloud.camera_m, device=cloud.depth_m.device)
        if by_loops:
            planes = torch.from_numpy(columns_seen(cloud.arrays(), step, camera.numpy()))
            depth, x, y, z = planes.unbind()
            return cls(depth, x, y, z, camera)
        depth, x, y, z = torch.stack([plane[:, ::step] for plane in cloud.planes])
        return cls(depth, x.sub_(cloud.camera_m[0]), y.sub_(cloud.camera_m[1]), z, camera)

    @property
    def valid(self) -> Tensor:
        """Mask (rows, columns) of pixels with depth."""
        return self.depth > 0

    def xy(self, at: Tensor | tuple[Tensor, ...]) -> Tensor:
        """(n, 2): ground positions from the camera of pixels, by mask or by row and column."""
        return torch.stack([self.x[at], self.y[at]], dim=-1)

    def in_map(self, xy: Tensor) -> Tensor:
        """Places (..., 2) in the map frame of ground positions from the camera."""
        x, y, _ = self.camera  # one plane after the other: last axes of two are slow
        return torch.stack([xy[..., 0] + x, xy[..., 1] + y], dim=-1)


def floor_points(cloud: PointCloud, params: MapParams) -> FloorPoints:
    """The floor and the drops that one depth image shows."""
    use_compiled = jit.usable(wanted=params.compiled, device=cloud.depth_m.device)
    image = _Image.of(cloud, by_loops=use_compiled)
    if use_compiled:
        arrays = image.depth.numpy(), image.z.numpy(), np.float32(params.occupancy_range_m)
        floor, edge = map(torch.from_numpy, floor_and_edges(*arrays))
    else:
        floor, edge = _floor_and_edges(image, image.valid, params.occupancy_range_m)
    drops = [floor.new_zeros((0, 2), dtype=torch.float32)]
    deep = -DROP_MIN_DEPTH_M / 2  # without pixels below there is neither an edge nor a riser
    if image.z.amin() < deep and (below := image.valid & (image.z < deep)).any():
        valid = image.valid
        feet = _riser_feet(image, valid, below)
        floor &= feet == 0
        low = image.z < -(DROP_MIN_DEPTH_M + TILT_ERROR_PER_M * image.depth)
        before = torch.cat([image.z[JUMP_ROWS:], image.z[-JUMP_ROWS:]])  # an edge's height
        drops += [
            _crossings(image, edge, before),
            _crossings(image, valid & low, torch.zeros_like(image.z)),
            _before_risers(image, feet),
        ]
    if not image.depth.amin() > 0:
        drops += _missing(image, image.valid, floor, params.cell_size_m)
    count = ceil(FLOOR_GAP_M / params.cell_size_m)
    shares, narrow = np.arange(1, count) / count, params.cell_size_m
    if use_compiled:
        x, y, seen_floor, camera = (
            each.numpy() for each in (image.x, image.y, floor, image.camera)
        )
        ratios = shares.astype(np.float32)
        places = seen_places(x, y, seen_floor, camera, ratios, np.float32(narrow))
        seen = torch.from_numpy(places)
        shares_of_way = _shares(BLIND_SAMPLES, image).numpy()
        blind = torch.from_numpy(blind_places(x, y, seen_floor, camera, shares_of_way))
    else:
        seen = torch.cat([image.in_map(image.xy(floor)), *_between(image, floor, shares, narrow)])
        blind = _blind(image, floor)
    return FloorPoints(seen, torch.cat(drops), blind)


def _floor_and_edges(image: _Image, valid: Tensor, farthest_m: float) -> tuple[Tensor, Tensor]:
    slack = HEIGHT_ERROR_PER_M * image.depth
    fall = DROP_MIN_DEPTH_M + slack
    edge = _edges(image, valid, fall)
    floor = valid & (image.z <= FLOOR_TOLERANCE_M + slack) & (image.z >= -fall)
    return floor & (image.depth <= farthest_m) & ~_behind_edge(image, edge), edge


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


def _riser_feet(image: _Image, valid: Tensor, low: Tensor) -> Tensor:
    """(rows, columns): how many rows below a riser's pixel there is one at its foot; 0: no riser.

    low: pixels below the floor, at least one.
    A riser is the upper part of a wall below the floor, and the rim above it. What goes on to rise
    is the foot of something that stands on floor which an error of the pitch lowers.
    """
    window = max(2, len(valid) // RISER_ROWS)
    feet = torch.zeros_like(image.depth, dtype=torch.int64)
    if len(valid) <= window:
        return feet
    columns = torch.nonzero(low.any(dim=0)).squeeze(1)
    depth, x, y, z = (plane[:, columns] for plane in (image.depth, image.x, image.y, image.z))
    valid, low, found = valid[:, columns], low[:, columns], feet[:, columns]
    fall = DROP_MIN_DEPTH_M + HEIGHT_ERROR_PER_M * depth
    top = valid & (z.abs() <= FLOOR_TOLERANCE_M + TILT_ERROR_PER_M * depth)
    top &= depth <= DROP_RANGE_M
    top[:window] = False
    top[window:] &= valid[:-window] & ~_is_steep(x, y, z, window)
    for k in range(1, window + 1):
        upper, lower = slice(None, -k), slice(k, None)
        there = top[upper] & low[lower] & (found[upper] == 0)
        there &= (z[upper] - z[lower] > fall[upper]) & _is_steep(x, y, z, k)
        found[upper].masked_fill_(there, k)
    feet[:, columns] = found
    return feet


def _is_steep(x: Tensor, y: Tensor, z: Tensor, rows: int) -> Tensor:
    """Whether it rises steeply from each pixel but the first ``rows`` to the one so far above."""
    dx, dy, rise = (plane[:-rows] - plane[rows:] for plane in (x, y, z))
    return (rise > 0) & (RISER_SLOPE**2 * (dx * dx + dy * dy) <= rise * rise)


def _before_risers(image: _Image, feet: Tensor) -> Tensor:
    """Places (n, 2) before risers: from where the ray to the foot crosses the height of the top."""
    row, column = torch.nonzero(feet, as_tuple=True)
    if len(row) == 0:
        return image.xy((row, column))
    foot = row + feet[row, column]
    scale = image.camera[2] - image.z[row, column]
    scale = scale / (image.camera[2] - image.z[foot, column]).clamp(min=1e-3)
    top_xy, foot_xy = image.xy((row, column)), image.xy((foot, column)) * scale[:, None]
    return _along(image, foot_xy, top_xy, _shares(RISER_SAMPLES, image))


def _crossings(image: _Image, chosen: Tensor, height_m: Tensor) -> Tensor:
    """Where the rays to chosen pixels cross a height (rows, columns)."""
    at = torch.nonzero(chosen, as_tuple=True)
    if len(at[0]) == 0:
        return image.xy(at)
    scale = image.camera[2] - height_m[at]
    scale = scale / (image.camera[2] - image.z[at]).clamp(min=1e-3)
    near = (scale > 0) & (scale * image.depth[at] <= DROP_RANGE_M)
    return image.in_map(image.xy(at) * scale[:, None])[near]


def _missing(image: _Image, valid: Tensor, floor: Tensor, cell_size_m: float) -> list[Tensor]:
    """Places just beyond floor that ends at a large hole without returns, and across the hole.

    Beyond it is a cell further, away from the camera or sideways.
    """
    rows, columns = valid.shape
    tall, wide = max(2, rows // MISSING_ROWS), max(1, columns // MISSING_COLUMNS)
    count = torch.zeros((rows + 1, columns + 1), dtype=torch.int32, device=valid.device)
    count[1:, 1:] = (~valid).cumsum(dim=0, dtype=torch.int32).cumsum(dim=1, dtype=torch.int32)
    near = floor & (image.depth <= MISSING_FLOOR_RANGE_M)
    beside = torch.stack([valid[:-2, 1:-1], valid[1:-1, :-2], valid[1:-1, 2:]])
    side, row, column = torch.nonzero(near[1:-1, 1:-1] & ~beside, as_tuple=True)
    row, column, up = row + 1, column + 1, side == 0  # the others: to the left and to the right
    right = torch.where(up, 0, 2 * side - 3)
    top = (row - tall).clamp(min=0)
    left = (column + torch.where(up, -wide // 2, right * wide)).clamp(min=0)
    left = torch.minimum(left, column + right)
    bottom, end = (top + tall).clamp(max=rows), (left + wide).clamp(max=columns)
    missing = count[bottom, end] - count[top, end] - count[bottom, left] + count[top, left]
    large = missing.double() >= MISSING_SHARE * tall * wide
    row, column, up, right = (each[large] for each in (row, column, up, right))
    xy = image.xy((row, column))
    ahead = xy / lengths(xy).clamp(min=1e-3)[:, None]
    aside = torch.stack([ahead[:, 1], -ahead[:, 0]], dim=1) * right[:, None]
    beyond = image.in_map(xy + cell_size_m * torch.where(up[:, None], ahead, aside))
    return [beyond, _across(image, (row[up], column[up]), valid, floor)]


def _across(image: _Image, at: tuple[Tensor, Tensor], valid: Tensor, floor: Tensor) -> Tensor:
    """Places between pixels ``at`` and the next return above them, where that is floor."""
    row, column = at
    if len(row) == 0:
        return image.xy(at)
    rows = torch.arange(len(valid), device=valid.device)[:, None]
    far = torch.where(valid, rows, -1).cummax(dim=0).values[row - 1, column]
    there = (far >= 0) & floor[far, column]
    row, column, far = row[there], column[there], far[there]
    shares = _shares(ACROSS_SAMPLES, image, first=0.5)
    return _along(image, image.xy((row, column)), image.xy((far, column)), shares)


def _between(image: _Image, floor: Tensor, shares: F64, narrow_m: float) -> list[Tensor]:
    """Places between floor pixels that are neighbours in a column but cells apart."""
    upper = torch.nonzero(floor[:-1] & floor[1:], as_tuple=True)
    upper_xy, step = image.xy(upper), image.xy((upper[0] + 1, upper[1])) - image.xy(upper)
    gap_m = torch.hypot(step[:, 0], step[:, 1])
    wide = (gap_m > narrow_m) & (gap_m <= FLOOR_GAP_M)
    places, step = image.in_map(upper_xy[wide]), step[wide]
    return [places + step * share for share in shares.tolist()]


def _blind(image: _Image, floor: Tensor) -> Tensor:
    """Places from the camera's foot to the floor at the lower edge of the image.

    Only where the lower edge shows floor to both sides too: beside a hole there is an edge.
    """
    side = floor.shape[1] // BLIND_SIDE
    others = (~floor[-1:]).float()
    nearest = torch.nn.functional.max_pool1d(others, 2 * side + 1, 1, side)[0] == 0
    last_xy = torch.stack([image.x[-1, nearest], image.y[-1, nearest]], dim=-1)
    return _along(image, torch.zeros_like(last_xy), last_xy, _shares(BLIND_SAMPLES, image))


def _along(image: _Image, start: Tensor, end: Tensor, shares: Tensor) -> Tensor:
    """Places (n * k, 2) in the map at shares (k,) of the way, of positions (n, 2)."""
    x, y = (
        a[:, None] + (b - a)[:, None] * shares
        for a, b in zip(start.unbind(1), end.unbind(1), strict=True)
    )
    return image.in_map(torch.stack([x.flatten(), y.flatten()], dim=1))


def _shares(count: int, image: _Image, first: float = 0.0) -> Tensor:
    """first, first + 1, ... (count,) float32, divided by ``count``."""
    numbers = torch.arange(count, device=image.depth.device, dtype=torch.float32)
    return divided(numbers + first, count)
