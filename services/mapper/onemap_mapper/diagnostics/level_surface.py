"""The lowest level surface in one depth image: the floor, where it is in view.

The image is divided into tiles and a plane is fitted to each, in inverse depth: a plane is
n . (P - camera) = 1, so 1/depth = n . d is linear in the pixel's direction d, which is
(P - camera) / depth, and the noise of a depth camera, which grows with the square of the distance,
is the same for all pixels. Tiles that face up and touch each other at one height make a surface.
Walls, fronts of furniture, ramps and noise make none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from onemap_mapper.kernels.tile_labels import tile_labels
from onemap_mapper.kernels.tile_sums import tile_sums
from onemap_mapper.point_cloud import PointCloud
from onemap_shared.geometry import F64, I64, Bool

RANGE_M = (0.3, 4.0)  # nearer is the robot itself; farther, a tile of floor is a metre long
IMAGE_ROWS = 120  # larger images are thinned to this height: 8 x 8 pixels a tile are enough
TILE_ROWS = 15  # tiles in a column of the image
TILE_MIN_PX = 8
TILE_MIN_VALID = 0.75  # of its pixels
MAX_RESIDUAL_PER_M = 0.03  # rms of 1/depth in 1/m: 3 cm of noise at 1 m, 12 cm at 2 m
MAX_TILT_RAD = float(np.deg2rad(12.0))  # an error of 5 degrees, and the noise of one tile
MAX_STEP_M = 0.03  # between neighbouring tiles of one surface
RIDGE = 1e-12  # keeps the fit solvable where a very long focal length makes all rays equal
MIN_SHARE = 0.02  # of the image's tiles; less is a shelf or a box, whose tilt is uncertain


@dataclass(frozen=True, slots=True)
class LevelSurface:
    """Mean height above z = 0 in metres where it is seen, and angle to the horizontal in rad."""

    height_m: float
    tilt_rad: float


@dataclass(frozen=True, slots=True)
class _Sums:
    """Sums over the pixels of each tile (rows, columns) that lie in range, in the map's axes.

    A (..., 3): of the ray directions, points from the camera over depth; AtA (..., 3, 3): of their
    outer products; Atq (..., 3): times 1/depth; qq: of the squares of 1/depth; count of pixels.
    """

    AtA: F64
    Atq: F64
    A: F64
    qq: F64
    count: F64 | I64


@dataclass(frozen=True, slots=True)
class _Tiles:
    """Planes of the tiles, in image order (rows, columns).

    AtA (..., 3, 3) and Atq (..., 3): normal equations of 1/depth over the ray directions;
    n (..., 3) the plane, NaN where none fits; centres (..., 3) metres. All in the map's axes.
    """

    AtA: F64
    Atq: F64
    n: F64
    centres: F64


def lowest_level_surface(cloud: PointCloud, *, compiled: bool = False) -> LevelSurface | None:
    """The lowest level surface seen from above within 4 m; None if there is none.

    compiled: the sums over pixels by a compiled loop, equal up to rounding, and the sets of tiles.
    """
    cloud = cloud.strided(max(1, cloud.depth_m.shape[0] // IMAGE_ROWS))
    tiles = _fit(cloud, _compiled_sums if compiled else _sums)
    up = -_unit(tiles.n)  # n points away from the camera
    level = np.nan_to_num(up[..., 2], nan=-1.0) > np.cos(MAX_TILT_RAD)
    surfaces = [
        _surface(tiles, members)
        for members in _connected(tiles.centres, up, level, compiled=compiled)
        if members.sum() >= max(2.0, MIN_SHARE * level.size)
    ]
    return min(surfaces, key=lambda surface: surface.height_m, default=None)


def _fit(cloud: PointCloud, sums_of: Callable[[PointCloud, int], _Sums]) -> _Tiles:
    """A plane for every tile of the image."""
    side = max(TILE_MIN_PX, cloud.depth_m.shape[0] // TILE_ROWS)
    sums = sums_of(cloud, side)
    AtA, Atq, count = sums.AtA + RIDGE * np.eye(3), sums.Atq, sums.count
    full = count >= TILE_MIN_VALID * side**2
    n = np.full(Atq.shape, np.nan)
    n[full] = np.linalg.solve(AtA[full], Atq[full][..., None])[..., 0]
    squares = sums.qq - (n * Atq).sum(axis=-1)  # of the residuals at the minimum
    n[~(squares <= MAX_RESIDUAL_PER_M**2 * count)] = np.nan
    centre_rays = sums.A / np.maximum(count, 1)[..., None]
    inverse_depth = (centre_rays * n).sum(axis=-1)
    inverse_depth[~(inverse_depth > 0)] = np.nan
    centres = centre_rays / inverse_depth[..., None] + cloud.camera_m
    return _Tiles(AtA, Atq, n, centres)


def _sums(cloud: PointCloud, side: int) -> _Sums:
    """The sums over the pixels of each tile of side x side pixels."""
    rows, columns = (pixels // side for pixels in cloud.depth_m.shape)
    whole = slice(rows * side), slice(columns * side)
    depth = _tiled(cloud.depth_m[whole].astype(np.float64), side)
    valid = (depth > RANGE_M[0]) & (depth < RANGE_M[1])
    q = np.divide(1.0, depth, out=np.zeros(valid.shape), where=valid)
    A = _tiled(cloud.points_m[whole] - cloud.camera_m, side) * q[..., None]
    At = A.swapaxes(-1, -2)
    Atq = (At @ q[..., None])[..., 0]
    return _Sums(At @ A, Atq, A.sum(axis=-2), (q * q).sum(axis=-1), valid.sum(axis=-1))


def _compiled_sums(cloud: PointCloud, side: int) -> _Sums:
    """As ``_sums``, in one compiled pass."""
    depth_m = np.ascontiguousarray(cloud.depth_m)
    sums = tile_sums(depth_m, cloud.points_m, cloud.camera_m.copy(), side, RANGE_M)
    AtA = sums[..., [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(*sums.shape[:2], 3, 3)
    return _Sums(AtA, sums[..., 6:9], sums[..., 9:12], sums[..., 12], sums[..., 13])


def _tiled(pixels: F64, side: int) -> F64:
    """Pixels (H, W, ...) as (rows, columns, side * side, ...)."""
    height, width, *rest = pixels.shape
    blocks = pixels.reshape(height // side, side, width // side, side, *rest).swapaxes(1, 2)
    tiled: F64 = blocks.reshape(height // side, width // side, side * side, *rest)
    return tiled


def _unit(vectors: F64) -> F64:
    unit: F64 = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit


def _connected(centres: F64, up: F64, level: Bool, *, compiled: bool) -> list[Bool]:
    """Sets of level tiles (rows, columns) that continue each other's planes."""
    across = _continues(centres[:, :-1], centres[:, 1:], up[:, :-1] + up[:, 1:])
    across &= level[:, :-1] & level[:, 1:]
    down = _continues(centres[:-1], centres[1:], up[:-1] + up[1:]) & level[:-1] & level[1:]
    labels = (tile_labels if compiled else labels_by_numpy)(level, across, down)
    return [labels == label for label in np.unique(labels[level])]


def labels_by_numpy(level: Bool, across: Bool, down: Bool) -> I64:
    """As ``tile_labels``."""
    labels: I64 = np.where(level, np.arange(level.size).reshape(level.shape), level.size)
    while True:  # the smallest label spreads over each set
        before = labels.copy()
        for one, other, linked in (
            (labels[:, :-1], labels[:, 1:], across),
            (labels[:-1], labels[1:], down),
        ):
            smallest = np.minimum(one, other)[linked]
            one[linked] = smallest
            other[linked] = np.minimum(other[linked], smallest)
        if np.array_equal(before, labels):
            return labels


def _continues(centre: F64, neighbour: F64, up: F64) -> Bool:
    """Whether the neighbour lies in the plane through the tile with the mean normal of both."""
    apart = (_unit(up) * (neighbour - centre)).sum(axis=-1)
    linked: Bool = np.abs(np.nan_to_num(apart, nan=np.inf)) < MAX_STEP_M
    return linked


def _surface(tiles: _Tiles, members: Bool) -> LevelSurface:
    """One plane through all pixels of the tiles."""
    n = np.linalg.solve(tiles.AtA[members].sum(axis=0), tiles.Atq[members].sum(axis=0))
    tilt = float(np.arccos(np.clip(-_unit(n)[2], -1.0, 1.0)))
    return LevelSurface(float(tiles.centres[members][:, 2].mean()), tilt)
