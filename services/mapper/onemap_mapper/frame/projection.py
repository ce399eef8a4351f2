"""The pixels of one frame to its cells' features, without the upsampled feature image.

Interpolating patch features to pixels, weighting the pixels and summing them per cell are all
linear in the patch features. So only scalar weights are summed, into a sparse cells x patches
matrix W, and F_M = W F is one product.

W is made in two passes. The first finds each pixel's cell, in the arithmetic of
``unproject_to_map`` and ``world_cells``: to the last bit, so that it does not matter which of them
located a pixel. The second sums bilinear weights per (cell, patch), patch by patch, because the
pixels between four patch centres fall on few cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import embedding_bag

from onemap_mapper.params import MapParams
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, I32, I64
from onemap_shared.grid import GridSpec, GridTooLarge
from onemap_shared.jit import compiled

NOT_USED = np.int32(-(2**31))  # the cell of a pixel that carries no feature


class FeatureLimits(NamedTuple):
    """Farthest z-depth and greatest height of pixels with a feature; edge of a cell; metres."""

    farthest_m: np.float32
    highest_m: np.float32
    cell_size_m: np.float32


class CellBox(NamedTuple):
    """The lowest and the highest world cell of an image; low > high: it has none."""

    low_x: int
    low_y: int
    high_x: int
    high_y: int


class Interpolation(NamedTuple):
    """Per image row and column the patch before it, ascending, and the fraction to the next."""

    top: I64
    left: I64
    down: F32
    right: F32


@compiled
def locate(
    depth_m: F32, variance: F32, pixel_to_ray: F32, pose: F32, limits: FeatureLimits
) -> tuple[I32, I32, CellBox]:
    """World cells ix, iy (H, W) int32 of the pixels, and their box.

    ix is ``NOT_USED`` where they carry no feature. variance (H, W): infinity = do not use;
    pixel_to_ray: of ``Intrinsics``; pose (3, 4) float32: T_map_camera's upper rows.
    """
    height, width = depth_m.shape
    ix = np.empty((height, width), np.int32)
    iy = np.empty((height, width), np.int32)
    from_left, from_top, fx, fy = pixel_to_ray
    r00, r01, r02, tx = pose[0]
    r10, r11, r12, ty = pose[1]
    r20, r21, r22, tz = pose[2]
    size, most = limits.cell_size_m, np.int32(2**31 - 1)
    low_x, low_y, high_x, high_y = most, most, NOT_USED, NOT_USED
    columns = np.empty(width, np.float32)
    for j in range(width):
        columns[j] = np.float32(j) + from_left
    for i in range(height):
        row = np.float32(i) + from_top
        for j in range(width):
            d = depth_m[i, j]
            x = columns[j] * d / fx
            y = row * d / fy
            cell_x = np.int32(np.floor((x * r00 + y * r01 + d * r02 + tx) / size))
            cell_y = np.int32(np.floor((x * r10 + y * r11 + d * r12 + ty) / size))
            z = x * r20 + y * r21 + d * r22 + tz
            near = (d > 0) & (d <= limits.farthest_m)
            used = near & (variance[i, j] < np.inf) & (z <= limits.highest_m)
            ix[i, j] = cell_x if used else NOT_USED
            iy[i, j] = cell_y
            low_x = min(low_x, cell_x if used else most)
            low_y = min(low_y, cell_y if used else most)
            high_x = max(high_x, cell_x if used else NOT_USED)
            high_y = max(high_y, cell_y if used else NOT_USED)
    return ix, iy, CellBox(low_x, low_y, high_x, high_y)


@compiled
def gather(
    cells: tuple[I32, I32],
    variance: F32,
    box: CellBox,
    interpolation: Interpolation,
    patch_shape: tuple[int, int],
) -> tuple[I64, F32, I64, I64, F32]:
    """The rows of W: (cells, confidence, starts, patches, values) of ``CellWeights``.

    cells, variance, box: of ``locate``, with at least one used pixel.
    """
    top, left, down, right = interpolation
    area = (box.high_x - box.low_x + 1) * (box.high_y - box.low_y + 1)
    pixels = np.zeros(area, np.int32)
    newest = np.full(area, -1, np.int32)  # entry of each cell in the present patch quad
    most = variance.size  # entries, one per pixel; the few that are used take memory
    owner = np.empty(most, np.int32)  # cell of an entry
    quad = np.empty(most, np.int32)  # upper left patch of an entry
    sums = np.empty((most, 4), np.float32)
    count = np.int64(0)
    row = np.int64(0)
    for row_end in _ends(top):
        band = _band(cells, variance, (row, row_end), box)
        column = np.int64(0)
        for column_end in _ends(left):
            first, patch = count, top[row] * patch_shape[1] + left[column]
            count = _sum_block(
                band,
                (column, column_end, count),
                (down[row:row_end], right),
                (pixels, newest),
                (owner, sums),
            )
            for entry in range(first, count):
                quad[entry] = patch
            column = column_end
        row = row_end
    return _rows((owner[:count], quad[:count], sums), pixels, box, patch_shape)


@compiled
def _sum_block(
    image: tuple[I32, F32],
    block: tuple[int, int, int],
    fractions: tuple[F32, F32],
    cells: tuple[I32, I32],
    entries: tuple[I32, F32],
) -> int:
    """Add the pixels between four patch centres to new entries; returns the last one's end.

    image: of ``_band``; block: its columns, from and to, and the first new entry. A run of pixels
    of a row in one cell is summed before it is added.
    """
    (flat, weight), (down, right) = image, fractions
    (pixels, newest), (owner, sums) = cells, entries
    column, column_end, first = block
    count = first
    for i in range(len(flat)):
        of_row, weights = flat[i, column:column_end], weight[i, column:column_end]
        shares = right[column:column_end]
        entry, start, cell = np.int64(0), 0, np.int32(-1)
        whole = beside = np.float32(0)
        for j in range(len(of_row)):  # one loop, without a search for the end: runs are short
            if of_row[j] != cell:
                if cell >= 0:
                    pixels[cell] += j - start
                    _add_run(sums[entry], whole, beside, down[i])
                cell, start = of_row[j], j
                whole = beside = np.float32(0)
                if cell >= 0:
                    entry = np.int64(newest[cell])
                    if entry < first:
                        entry = count
                        newest[cell], owner[entry] = entry, cell
                        sums[entry, 0] = sums[entry, 1] = sums[entry, 2] = sums[entry, 3] = 0
                        count += 1
            whole += weights[j]
            beside += weights[j] * shares[j]
        if cell >= 0:
            pixels[cell] += len(of_row) - start
            _add_run(sums[entry], whole, beside, down[i])
    return count


@compiled
def _add_run(sums: F32, whole: float, beside: float, down: float) -> None:
    """Add a run of pixels to the sums (4,) of an entry: their weight, and times ``right``."""
    sums[0] += (np.float32(1) - down) * (whole - beside)
    sums[1] += (np.float32(1) - down) * beside
    sums[2] += down * (whole - beside)
    sums[3] += down * beside


@compiled
def _band(
    cells: tuple[I32, I32], variance: F32, rows: tuple[int, int], box: CellBox
) -> tuple[I32, F32]:
    """Of some rows of an image, which so stay in the cache: flat cells in the box, confidences.

    -1 is the cell of a pixel that is not used.
    """
    (ix, iy), (first, end) = cells, rows
    flat = np.empty((end - first, ix.shape[1]), np.int32)
    confidence = np.empty(flat.shape, np.float32)
    low_x, low_y = np.int32(box.low_x), np.int32(box.low_y)
    depth = np.int32(box.high_y - box.low_y + 1)
    for i in range(first, end):
        for j in range(ix.shape[1]):
            index = np.int32(np.int32(ix[i, j] - low_x) * depth + np.int32(iy[i, j] - low_y))
            flat[i - first, j] = index if ix[i, j] != NOT_USED else np.int32(-1)
            confidence[i - first, j] = np.float32(1) / variance[i, j]
    return flat, confidence


@compiled
def _ends(before: I64) -> I64:
    """Where each run of equal values of an ascending array ends, exclusive."""
    ends = np.empty(len(before) + 1, np.int64)
    count = 0
    for k in range(1, len(before)):
        if before[k] != before[k - 1]:
            ends[count] = k
            count += 1
    ends[count] = len(before)
    return ends[: count + 1]


@compiled
def _rows(
    entries: tuple[I32, I32, F32],
    pixels: I32,
    box: CellBox,
    patch_shape: tuple[int, int],
) -> tuple[I64, F32, I64, I64, F32]:
    """Entries (owner, quad, sums of four patches) as normalised rows, cells ascending."""
    owner, quad, sums = entries
    h, w = patch_shape
    below, beside = w * np.int64(h > 1), np.int64(w > 1)
    depth = box.high_y - box.low_y + 1
    order, bounds = _by_owner(owner, len(pixels))
    count = np.int64(0)
    for number in pixels:
        count += number != 0
    cells = np.empty((count, 2), np.int64)
    confidence = np.empty(count, np.float32)
    starts = np.empty(count, np.int64)
    patches = np.empty(4 * len(owner), np.int64)
    values = np.empty(4 * len(owner), np.float32)
    weight = np.zeros(h * w, np.float32)
    filled = row = np.int64(0)
    for cell in range(len(pixels)):
        if pixels[cell] == 0:
            continue
        starts[row] = filled
        total = np.float32(0)
        for k in range(bounds[cell], bounds[cell + 1]):
            entry = order[k]
            for corner in range(4):
                value = sums[entry, corner]
                if value <= 0:
                    continue
                patch = quad[entry] + (corner >> 1) * below + (corner & 1) * beside
                if weight[patch] == 0:
                    patches[filled] = patch
                    filled += 1
                weight[patch] += value
                total += value
        for k in range(starts[row], filled):
            values[k] = weight[patches[k]] / total
            weight[patches[k]] = 0
        cells[row, 0] = cell // depth + box.low_x
        cells[row, 1] = cell % depth + box.low_y
        confidence[row] = total / np.float32(pixels[cell])
        row += 1
    return cells, confidence, starts, patches[:filled], values[:filled]


@compiled
def _by_owner(owner: I32, cells: int) -> tuple[I32, I64]:
    """Entries ordered by their cell, and where each cell's begin (cells + 1)."""
    bounds = np.zeros(cells + 1, np.int64)
    for cell in owner:
        bounds[cell + 1] += 1
    for cell in range(cells):
        bounds[cell + 1] += bounds[cell]
    place = bounds.copy()
    order = np.empty(len(owner), np.int32)
    for entry, cell in enumerate(owner):
        order[place[cell]] = entry
        place[cell] += 1
    return order, bounds


MAX_FRAME_CELLS = 2**17  # observed by one frame: 90 degrees to 40 m; the blur takes 3 kB for each
MAX_ENTRIES = 2**26  # cells times patches, with 9 bytes for each while W is made


@dataclass(frozen=True, slots=True)
class SparseRows:
    """A sparse matrix in compressed rows.

    starts (n,), columns (m,) int64, values (m,) float32: row i has values[k] in columns[k] for k
    from starts[i] up to the next row's start.
    """

    starts: I64
    columns: I64
    values: F32

    def times(self, table: Tensor) -> Tensor:
        """The product (n, D) with a table (K, D) float32, on the table's device."""
        if len(self.starts) == 0:
            return table.new_zeros((0, table.shape[1]))
        starts, columns, values = (
            torch.from_numpy(each).to(table.device)
            for each in (self.starts, self.columns, self.values)
        )
        return embedding_bag(columns, table, starts, mode="sum", per_sample_weights=values)


NO_ROWS = SparseRows(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.float32))


@dataclass(frozen=True, slots=True)
class CellWeights:
    """The matrix W of one frame.

    cells (n, 2) int64 world cells; confidence (n,) float32 c_M, the mean inverse variance;
    rows: of W, one per cell over the patches (row-major), values >= 0, each row summing to 1.
    """

    cells: I64
    confidence: F32
    rows: SparseRows


def check_size(cells: int, patch_shape: tuple[int, int]) -> None:
    """Raise ``GridTooLarge`` if W would be too large."""
    if cells > MAX_FRAME_CELLS or cells * math.prod(patch_shape) > MAX_ENTRIES:
        raise GridTooLarge(
            f"the frame observes {cells} cells with {math.prod(patch_shape)} patches; the limits "
            f"are {MAX_FRAME_CELLS} cells and {MAX_ENTRIES} pairs: are the intrinsics right?"
        )


@lru_cache(maxsize=8)  # of an image's rows and columns; not to be written
def interpolation(pixels: int, patches: int) -> tuple[I64, F32]:
    """Per pixel the patch before it (int64) and the fraction towards the next (float32).

    Half-pixel centres with border clamping, as bilinear resizing with align_corners=False.
    """
    position = (np.arange(pixels) + 0.5) * patches / pixels - 0.5
    position = position.clip(0, patches - 1)
    before = np.minimum(np.floor(position), max(patches - 2, 0)).astype(np.int64)
    return before, (position - before).astype(np.float32)


def project(
    depth_m: F32,
    variance: F32,
    *,
    intrinsics: Intrinsics,
    T_map_camera: F64,
    patch_shape: tuple[int, int],
    params: MapParams,
) -> CellWeights:
    """The cells that a frame observes, and the weights of its patches in them.

    depth_m (H, W) float32 metres, 0 = no return; variance (H, W) float32 > 0, infinity = do not
    use.
    """
    check_size(1, patch_shape)  # before arrays of its size are made
    variance = np.ascontiguousarray(variance).view()
    variance.flags.writeable = False  # as it comes from the bus: each kind is compiled anew
    limits = FeatureLimits(
        np.float32(params.max_feature_range_m),
        np.float32(params.max_feature_height_m),
        np.float32(params.cell_size_m),
    )
    ix, iy, box = locate(
        np.ascontiguousarray(depth_m),
        variance,
        intrinsics.pixel_to_ray,
        T_map_camera[:3].astype(np.float32),
        limits,
    )
    low_x, low_y, high_x, high_y = box
    if low_x > high_x:
        return CellWeights(np.zeros((0, 2), np.int64), NO_ROWS.values, NO_ROWS)
    GridSpec(params.cell_size_m, (low_x, low_y), (high_x - low_x + 1, high_y - low_y + 1))
    (top, down), (left, right) = map(interpolation, depth_m.shape, patch_shape)
    between = Interpolation(top, left, down, right)
    cells, confidence, starts, patches, values = gather(
        (ix, iy), variance, box, between, patch_shape
    )
    check_size(len(cells), patch_shape)
    return CellWeights(cells, confidence, SparseRows(starts, patches, values))
