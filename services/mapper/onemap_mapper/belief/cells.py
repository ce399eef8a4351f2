"""The belief of every observed cell: its feature and its three confidences.

Fusion is Eqs. bayes1-3 with the confidence c = 1 / sigma^2. The printed equations weight features
by their variance, the released code and this module by its inverse: certain observations count
more. The result is the confidence-weighted mean of all observations, in whatever order they come.

Cells are packed in order of first observation ("slots"), so memory is proportional to the observed
area. Features lie in blocks, so that growing never copies them, on the device of the map; all else
that is kept of a slot is on the host. Of a frame, its slots and gains are sent to the features.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from onemap_mapper.belief.features import (
    FeatureTable,
    fuse_half_rows,
    fuse_rows,
    rounded,
    seeds,
)
from onemap_mapper.belief.view_log import ONE_VIEW, Views
from onemap_mapper.occupancy.heights import LEVELS
from onemap_mapper.transfers import to_device
from onemap_shared.geometry import F32, F64, I64
from onemap_shared.jit import compiled


def _mixed(colours: F32, new: F32, K: F32) -> F32:
    """Colours (n, 3) moved by gains (n,) towards new ones; where one is not known, the other."""
    mean: F32 = colours + K[:, None] * (new - colours)
    return np.where(np.isnan(colours), new, np.where(np.isnan(new), colours, mean))


TINY = 1e-38  # below any confidence: the gain of an unobserved cell is 0 / TINY, not NaN


def gain(confidence: F64, confidence_new: F64) -> F32:
    """K = c_new / (c + c_new), (n,) in [0, 1], of confidences (n,); 0 where both are 0.

    Eq. bayes1 in inverse-variance form; c + c_new is Eq. bayes3.
    """
    total = np.maximum(confidence + confidence_new, TINY)
    K: F32 = (confidence_new / total).astype(np.float32)
    return K


def fused(features: Tensor, features_new: Tensor, K: Tensor) -> Tensor:
    """F + K (F_new - F) for features (n, D) float32 and gains (n,) (Eq. bayes2)."""
    return torch.lerp(features, features_new, K[:, None])


BLOCK = 4096  # cells: 12 MB of 768 float32 channels is allocated at a time
SEARCHED, EXPLORED = 1, 2  # rows of the confidences, after c itself
# What the colours of a file count for at most, in near views, of c = 1: it does not say how many
# views told them, and ten more outweigh a glance.
COLOURS_OF_FILE = 10.0
GROUP = 64  # slots, whose newest change is kept: a frame's cells lie in some dozens of groups
RESERVE = 1.25  # times what there was, so that a large map is not copied for every block


def searched_row(robot: int) -> int:
    """The row of the confidences that holds 1 / sigma_E^2 of a robot, if there are so many."""
    return SEARCHED if robot == 0 else EXPLORED + robot


@compiled
def fuse_slots(
    held: tuple[F64, F32, F32, F64, I64, I64],
    frame: tuple[I64, F32, F32, F32],
    counts_for: F32,
    most: float,
    revision: int,
) -> tuple[F32, I64]:
    """Fuse all of an observation but its features.

    held: confidences (rows, slots), heights, colours, the confidences of these, and when slots and
    groups of them changed;
    frame: distinct slots (n,), confidence (n,), heights (n, LEVELS) and colours (n, 3), or none of
    them: not known; counts_for (rows,): how often; most: as ``max_prior``. Returns the gains (n,)
    and ``seeds`` (n,).
    """
    confidence, heights, colours, coloured, changed_at, group_changed_at = held
    slots, new, shares, lab = frame
    K, seed = np.empty(len(slots), np.float32), np.empty(len(slots), np.int64)
    bits = confidence[0].view(np.int64)
    for k in range(len(slots)):
        slot = slots[k]
        K[k] = np.float64(new[k]) / max(min(confidence[0, slot], most) + new[k], TINY)
        seed[k] = (bits[slot] ^ (bits[slot] >> 32)) & 0xFFFFFFFF
        if len(shares):
            for level in range(LEVELS):
                before = heights[slot, level]
                after = before + K[k] * (shares[k, level] - before)
                heights[slot, level] = max(after, np.float32(0))
        if len(lab) and not np.isnan(lab[k, 0]):
            share = np.float32(new[k] / max(min(coloured[slot], most) + new[k], TINY))
            coloured[slot] += new[k]
            for channel in range(3):
                before, seen = colours[slot, channel], lab[k, channel]
                mean = before + share * (seen - before)
                colours[slot, channel] = seen if np.isnan(before) else mean
        for row in range(len(counts_for)):
            if counts_for[row] > 0:
                confidence[row, slot] += counts_for[row] * new[k]
        changed_at[slot] = group_changed_at[slot // GROUP] = revision
    return K, seed


class BesideFeature(NamedTuple):
    """What an observation of n cells shows beside their features, or arrays without rows.

    heights (n, LEVELS) float32: shares of confidence by level; colours (n, 3) float32, Lab.
    """

    heights: F32
    colours: F32


NOT_KNOWN = BesideFeature(np.zeros((0, LEVELS), np.float32), np.zeros((0, 3), np.float32))


@dataclass(frozen=True, slots=True)
class FeatureShare:
    """What some frames contribute to cells, on the host.

    cells (n, 2) int64 distinct world cells; features (n, D), their confidence-weighted mean, in
    any precision; confidence and explored (n,) float64, the sums of c, and of that of keyframes;
    heights (n, LEVELS) float32, shares; colours (n, 3) float32, Lab, NaN: not known.
    """

    cells: I64
    features: Tensor
    confidence: F64
    explored: F64
    heights: F32
    colours: F32


class CellStore:
    """The slots of one map; the device and dtype of the features are fixed at construction.

    compiled: whether features on the CPU are fused and read by compiled loops.
    """

    def __init__(
        self,
        dimension: int,
        *,
        device: torch.device,
        dtype: torch.dtype,
        compiled: bool = False,
        max_prior: float = inf,
    ) -> None:
        self.dimension = dimension
        self.count = 0
        self.max_prior = max_prior  # what was known counts for at most, when frames are fused
        self._compiled = compiled and device.type == "cpu"
        self.device, self._dtype = device, dtype
        self._blocks: list[Tensor] = []
        # Rows: c, that of keyframes since the reset, that of all keyframes; from the fourth on, the
        # second for a further robot each, once it has one. In float64: sums of many small ones.
        self._confidence = np.zeros((3, 0))
        self._cells = np.zeros((0, 2), np.int64)
        self._changed_at = np.zeros(0, np.int64)
        self._group_changed_at = np.zeros(0, np.int64)  # the newest of each group of slots
        self._heights = np.zeros((0, LEVELS), np.float32)  # shares by level
        self._colours = np.zeros((0, 3), np.float32)  # Lab, NaN: not known
        self._coloured = np.zeros(0)  # c of the views that told a colour, 0: none did

    @property
    def nbytes(self) -> int:
        per_slot = (self._confidence, self._cells, self._changed_at, self._group_changed_at)
        told = self._heights, self._colours, self._coloured
        held = sum(array.nbytes for array in (*per_slot, *told))
        return held + sum(block.nbytes for block in self._blocks)

    @property
    def blocks(self) -> tuple[Tensor, ...]:
        """The tables (BLOCK, D) of features, as they are stored; not to be written."""
        return tuple(self._blocks)

    @property
    def cells(self) -> I64:
        """World cells (count, 2) of the slots; not to be written."""
        return self._cells[: self.count]

    @property
    def changed_at(self) -> I64:
        """Map revision (count,) at which each slot's feature last changed; not to be written."""
        return self._changed_at[: self.count]

    def changed_since(self, revision: int, kept: int) -> I64:
        """As ``FeatureTable.changed_since``; takes the time of what changed, not of the map."""
        kept = min(kept, self.count)
        groups = np.flatnonzero(self._group_changed_at > revision)
        slots = (groups[:, None] * GROUP + np.arange(GROUP)).ravel()
        slots = slots[slots < kept]
        changed = slots[self._changed_at[slots] > revision]
        return np.concatenate([changed, np.arange(kept, self.count)])

    @property
    def confidence(self) -> F32:
        """c = 1 / sigma^2 (count,) > 0."""
        return self._confidence[0, : self.count].astype(np.float32)

    @property
    def searched_confidence(self) -> F32:
        """1 / sigma_E^2 (count,) >= 0, of keyframes since the last reset."""
        return self._confidence[SEARCHED, : self.count].astype(np.float32)

    @property
    def explored_confidence(self) -> F32:
        """c (count,) >= 0 of keyframes only."""
        return self._confidence[EXPLORED, : self.count].astype(np.float32)

    def confidences(self, part: slice | I64) -> F32:
        """The confidences (3 + further robots, k) of these slots, as above."""
        confidences: F32 = self._confidence[:, part].astype(np.float32)
        return confidences

    @property
    def heights(self) -> F32:
        """Shares (count, LEVELS) of height of all slots; not to be written."""
        return self._heights[: self.count]

    @property
    def colours(self) -> F32:
        """Mean colours (count, 3) of all slots, Lab, NaN: not known; not to be written."""
        return self._colours[: self.count]

    def new_slots(self, cells: I64) -> I64:
        """New slots (n,) for world cells (n, 2) that have none."""
        first, self.count = self.count, self.count + len(cells)
        while len(self._blocks) * BLOCK < self.count:
            shape = (BLOCK, self.dimension)
            self._blocks.append(torch.zeros(shape, device=self.device, dtype=self._dtype))
        if self.count > len(self._cells):
            self._reserve(max(len(self._blocks) * BLOCK, int(len(self._cells) * RESERVE)))
        self._cells[first : self.count] = cells
        return np.arange(first, self.count)

    def _reserve(self, slots: int) -> None:
        extra, groups = slots - len(self._cells), -(-slots // GROUP) - len(self._group_changed_at)
        self._cells = np.pad(self._cells, ((0, extra), (0, 0)))
        self._changed_at = np.pad(self._changed_at, (0, extra))
        self._group_changed_at = np.pad(self._group_changed_at, (0, groups))
        self._confidence = np.pad(self._confidence, ((0, 0), (0, extra)))
        self._heights = np.pad(self._heights, ((0, extra), (0, 0)))
        self._colours = np.pad(self._colours, ((0, extra), (0, 0)), constant_values=np.nan)
        self._coloured = np.pad(self._coloured, (0, extra))

    def fuse(
        self,
        slots: I64,
        features: Tensor,
        confidence: F32,
        *,
        revision: int,
        views: Views = ONE_VIEW,
        beside: BesideFeature = NOT_KNOWN,
    ) -> None:
        """Fuse an observation, confidence (n,) and, on the device, features (n, D) float32, into
        distinct slots.

        views: how often it counts for searched and explored.
        """
        searched = self._searched_row(views.robot)
        counts_for = np.zeros(len(self._confidence), np.float32)
        counts_for[[0, searched, EXPLORED]] = 1.0, views.searched, views.explored
        changed = self._changed_at, self._group_changed_at
        told = self._heights, self._colours, self._coloured
        held = self._confidence, *told, *changed
        frame = slots, confidence, *beside
        K, seed = fuse_slots(held, frame, counts_for, float(self.max_prior), revision)
        self._move(slots, features, K, seed)

    def _move(self, slots: I64, features: Tensor, K: F32, seed: I64) -> None:
        """Move the features of distinct slots by gains K (n,) towards features (n, D)."""
        half = self._dtype == torch.float16
        if self._compiled:
            new = features.contiguous().numpy()
            for block in np.unique(slots // BLOCK).tolist():
                if half:
                    bits = self._blocks[block].view(torch.int16).numpy().view(np.uint16)
                    fuse_half_rows(bits, block * BLOCK, slots, new, K, seed)
                else:
                    fuse_rows(self._blocks[block].numpy(), block * BLOCK, slots, new, K)
            return
        for block, chosen, within in self._by_block(slots):
            table = self._blocks[block]
            index, rows = to_device(chosen, self.device), to_device(within, self.device)
            share = to_device(K[chosen], self.device)
            mean = fused(table[rows].float(), features[index], share)
            table[rows] = rounded(mean, to_device(seed[chosen], self.device)) if half else mean

    def put_in(self, slots: I64, share: FeatureShare, *, revision: int) -> None:
        """Fuse a share into the slots (n,) of its cells; what was known counts in full."""
        before = self._confidence[0, slots]
        K = gain(before, share.confidence)
        for first in range(0, len(slots), BLOCK):  # a map in float32 would take twice its memory
            some = slice(first, first + BLOCK)
            features = share.features[some].to(self.device).float()
            self._move(slots[some], features, K[some], seeds(before[some]))
        known = self._heights[slots]
        self._heights[slots] = np.maximum(known + K[:, None] * (share.heights - known), 0)
        told = np.minimum(share.confidence, COLOURS_OF_FILE) * ~np.isnan(share.colours[:, 0])
        K_colour = gain(self._coloured[slots], told)
        self._colours[slots] = _mixed(self._colours[slots], share.colours, K_colour)
        self._coloured[slots] += told
        self._confidence[0, slots] += share.confidence
        self._confidence[EXPLORED, slots] += share.explored
        self._changed_at[slots] = revision
        self._group_changed_at[slots // GROUP] = revision

    def features(self, slots: I64) -> Tensor:
        """Features (n, D) float32 of these slots, a copy on the device."""
        gathered = torch.empty((len(slots), self.dimension), device=self.device)
        for block, chosen, within in self._by_block(slots):
            rows = self._blocks[block][to_device(within, self.device)]
            gathered[to_device(chosen, self.device)] = rows.float()
        return gathered

    def table(self) -> FeatureTable:
        """All features, not copied, with a copy of when they changed."""
        return replace(self._shared_table(), changed_at=self.changed_at.copy())

    def copied(self, slots: I64) -> FeatureTable:
        """A copy of the features of ascending slots, as they are stored."""
        rows = torch.empty((len(slots), self.dimension), device=self.device, dtype=self._dtype)
        bounds = np.searchsorted(slots, np.arange(len(self._blocks) + 1) * BLOCK)
        for block, (start, end) in enumerate(pairwise(bounds.tolist())):
            if start == end:
                continue
            within = to_device(slots[start:end] - block * BLOCK, self.device)
            torch.index_select(self._blocks[block], 0, within, out=rows[start:end])
        changed_at = self._changed_at[slots]
        return FeatureTable((rows,), changed_at, self.device, self._compiled, slots, self.count)

    def chunks(self, slots: I64) -> Iterator[tuple[I64, Tensor]]:
        """As ``FeatureTable.chunks``, for as long as nothing changes."""
        return self._shared_table().chunks(slots)

    def products(self, slots: I64, vectors: Tensor) -> Tensor:
        """As ``FeatureTable.products``."""
        return self._shared_table().products(slots, vectors)

    def _shared_table(self) -> FeatureTable:
        """All features for as long as nothing changes."""
        return FeatureTable(self.blocks, self.changed_at, self.device, self._compiled)

    def doubt(self, slots: I64, most: float) -> None:
        """Let what is known of slots count for ``most`` at most from now on."""
        self._confidence[0, slots] = np.minimum(self._confidence[0, slots], most)
        self._coloured[slots] = np.minimum(self._coloured[slots], most)

    def reset_searched(self, robot: int = 0) -> None:
        """Set sigma_E of a robot to infinity in all slots; features and their confidence stay."""
        row = self._searched_row(robot)
        self._confidence[row] = 0.0

    def set_confidence(self, row: int, confidence: F32) -> None:
        """Set a row (count,) of the confidences, ``SEARCHED`` or ``EXPLORED``, as of a file."""
        self._confidence[row, : self.count] = confidence

    def _searched_row(self, robot: int) -> int:
        """The row of 1 / sigma_E^2 of a robot, made where it has none yet."""
        row = searched_row(robot)
        missing = row + 1 - len(self._confidence)
        if missing > 0:
            self._confidence = np.pad(self._confidence, ((0, missing), (0, 0)))
        return row

    def _by_block(self, slots: I64) -> Iterator[tuple[int, I64, I64]]:
        """Per block with some of the slots: its number, their indices, their rows in the block."""
        owner = slots // BLOCK
        for block in np.unique(owner).tolist():
            chosen = np.flatnonzero(owner == block)
            yield block, chosen, slots[chosen] - block * BLOCK
