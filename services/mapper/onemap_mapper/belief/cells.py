"""The belief of every observed cell: its feature and its three confidences.

Fusion is Eqs. bayes1-3 with the confidence c = 1 / sigma^2. The printed equations weight features
by their variance, the released code and this module by its inverse: certain observations count
more. The result is the confidence-weighted mean of all observations, in whatever order they come.

Cells are packed in order of first observation ("slots"), so memory is proportional to the observed
area. Features lie in blocks, so that growing never copies them. All that is kept of a slot is on
the device of the map, so that a frame, which is computed there, brings nothing back. Slots are
given as numbers on the host or the device.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np
import torch
from torch import Tensor

from onemap_mapper import jit
from onemap_mapper.belief.features import (
    FeatureTable,
    fuse_half_rows,
    fuse_rows,
    rounded,
    seeds,
)
from onemap_mapper.belief.view_log import ONE_VIEW, Views
from onemap_mapper.jit import compiled
from onemap_mapper.occupancy.heights import LEVELS
from onemap_mapper.transfers import Index, to_device, to_host
from onemap_shared.geometry import F32, F64, I64

TINY = 1e-38  # below any confidence: the gain of an unobserved cell is 0 / TINY, not NaN


def gain(confidence: Tensor, confidence_new: Tensor) -> Tensor:
    """K = c_new / (c + c_new), (n,) float32 in [0, 1], of confidences (n,); 0 where both are 0.

    Eq. bayes1 in inverse-variance form; c + c_new is Eq. bayes3.
    """
    total = confidence + confidence_new
    return confidence_new / total.clamp(min=TINY)


def fused(features: Tensor, features_new: Tensor, K: Tensor) -> Tensor:
    """F + K (F_new - F) for features (n, D) float32 and gains (n,) (Eq. bayes2)."""
    return torch.lerp(features, features_new, K[:, None])


BLOCK = 4096  # cells: 12 MB of 768 float32 channels is allocated at a time
SEARCHED, EXPLORED = 1, 2  # rows of the confidences, after c itself
GROUP = 64  # slots, whose newest change is kept: a frame's cells lie in some dozens of groups
RESERVE = 1.25  # times what there was, so that a large map is not copied for every block


def searched_row(robot: int) -> int:
    """The row of the confidences that holds 1 / sigma_E^2 of a robot, if there are so many."""
    return SEARCHED if robot == 0 else EXPLORED + robot


@compiled
def fuse_slots(
    held: tuple[F64, F32, I64, I64],
    frame: tuple[I64, F32, F32],
    counts_for: F32,
    most: float,
    revision: int,
) -> tuple[F32, I64]:
    """Fuse all of an observation but its features, as ``CellStore.fuse`` does in torch.

    held: confidences (rows, slots), heights, and when slots and groups of them changed; frame:
    distinct slots (n,), confidence (n,), heights (n, LEVELS), or (0, LEVELS): not known; counts_for
    (rows,): how often; most: as ``max_prior``. Returns the gains (n,) and ``seeds`` (n,).
    """
    (confidence, heights, changed_at, group_changed_at), (slots, new, shares) = held, frame
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
        for row in range(len(counts_for)):
            if counts_for[row] > 0:
                confidence[row, slot] += counts_for[row] * new[k]
        changed_at[slot] = group_changed_at[slot // GROUP] = revision
    return K, seed


def _arrays(tensors: tuple[Tensor, ...]) -> Any:
    """Tensors of the host as contiguous arrays, for compiled code; held ones share their memory."""
    return tuple(tensor.contiguous().numpy() for tensor in tensors)


@dataclass(frozen=True, slots=True)
class FeatureShare:
    """What some frames contribute to cells, on the host.

    cells (n, 2) int64 distinct world cells; features (n, D), their confidence-weighted mean, in
    any precision; confidence and explored (n,) float64, the sums of c, and of that of keyframes;
    heights (n, LEVELS) float32, shares.
    """

    cells: I64
    features: Tensor
    confidence: Tensor
    explored: Tensor
    heights: F32


class CellStore:
    """The slots of one map; the device, and the dtype of the features, are fixed at construction.

    It has two kinds of readers: those that ask for arrays on the host (``cells``), and those that
    compute on the device.
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
        self._compiled = jit.usable(wanted=compiled, device=device)
        self.device, self._device, self._dtype = device, device, dtype
        self._blocks: list[Tensor] = []
        # Rows: c, that of keyframes since the reset, that of all keyframes; from the fourth on, the
        # second for a further robot each, once it has one. In float64: sums of many small ones.
        self._confidence = torch.zeros((3, 0), dtype=torch.float64, device=device)
        self._cells = torch.zeros((0, 2), dtype=torch.int64, device=device)
        self._changed_at = self._cells.new_zeros(0)
        self._group_changed_at = self._cells.new_zeros(0)  # the newest of each group of slots
        self._heights = torch.zeros((0, LEVELS), device=device)  # shares by level

    @property
    def nbytes(self) -> int:
        per_slot = (self._confidence, self._cells, self._changed_at, self._group_changed_at)
        return sum(held.nbytes for held in (*self._blocks, *per_slot, self._heights))

    @property
    def blocks(self) -> tuple[Tensor, ...]:
        """The tables (BLOCK, D) of features, as they are stored; not to be written."""
        return tuple(self._blocks)

    @property
    def cells(self) -> I64:
        """World cells (count, 2) of the slots, on the host; not to be written."""
        cells: I64 = to_host(self._cells[: self.count])
        return cells

    @property
    def changed_at(self) -> Tensor:
        """Map revision (count,) int64 at which each slot's feature last changed."""
        return self._changed_at[: self.count]

    def changed_since(self, revision: int, kept: int) -> I64:
        """As ``FeatureTable.changed_since``; takes the time of what changed, not of the map."""
        kept = min(kept, self.count)
        groups = torch.nonzero(self._group_changed_at > revision)
        slots = (groups * GROUP + torch.arange(GROUP, device=self._device)).flatten()
        slots = slots[slots < kept]
        changed = to_host(slots[self._changed_at[slots] > revision])
        return np.concatenate([changed, np.arange(kept, self.count)])

    @property
    def confidence(self) -> Tensor:
        """c = 1 / sigma^2 (count,) float32 > 0, on the device as all confidences."""
        return self._confidence[0, : self.count].float()

    @property
    def searched_confidence(self) -> Tensor:
        """1 / sigma_E^2 (count,) float32 >= 0, of keyframes since the last reset."""
        return self._confidence[1, : self.count].float()

    @property
    def explored_confidence(self) -> Tensor:
        """c (count,) float32 >= 0 of keyframes only."""
        return self._confidence[2, : self.count].float()

    def confidences(self, part: slice | Tensor) -> Tensor:
        """The confidences (3 + further robots, k) float32 of these slots, as above."""
        return self._confidence[:, part].float()

    @property
    def all_heights(self) -> Tensor:
        """Shares (count, LEVELS) of height of all slots; not to be written."""
        return self._heights[: self.count]

    def heights(self, slots: Tensor | slice) -> Tensor:
        """Shares (n, LEVELS) float32 of height of these slots, a copy."""
        return self._heights[slots].clone()

    def add(self, cells: Index) -> Tensor:
        """New slots (n,) for world cells (n, 2) that have none."""
        first, self.count = self.count, self.count + len(cells)
        while len(self._blocks) * BLOCK < self.count:
            shape = (BLOCK, self.dimension)
            self._blocks.append(torch.zeros(shape, device=self._device, dtype=self._dtype))
        if self.count > len(self._cells):
            self._reserve(max(len(self._blocks) * BLOCK, int(len(self._cells) * RESERVE)))
        self._cells[first : self.count] = to_device(cells, self._device)
        return torch.arange(first, self.count, device=self._device)

    def _reserve(self, slots: int) -> None:
        extra, groups = slots - len(self._cells), -(-slots // GROUP) - len(self._group_changed_at)
        self._cells = torch.cat([self._cells, self._cells.new_zeros((extra, 2))])
        self._changed_at = torch.cat([self._changed_at, self._changed_at.new_zeros(extra)])
        older = self._group_changed_at
        self._group_changed_at = torch.cat([older, older.new_zeros(groups)])
        grown = self._confidence.new_zeros((len(self._confidence), extra))
        self._confidence = torch.cat([self._confidence, grown], dim=1)
        self._heights = torch.cat([self._heights, self._heights.new_zeros((extra, LEVELS))])

    def fuse(
        self,
        slots: Index,
        features: Tensor,
        confidence: Tensor,
        *,
        revision: int,
        views: Views = ONE_VIEW,
        heights: Tensor | None = None,
    ) -> None:
        """Fuse an observation, features (n, D) and confidence (n,) float32, into distinct slots.

        The arrays are on the device. views: how often it counts for searched and explored; heights
        (n, LEVELS): its shares of height, None if they are not known.
        """
        slots = to_device(slots, self._device)
        searched = self._searched_row(views.robot)
        counts_for = ((0, 1.0), (searched, views.searched), (EXPLORED, views.explored))
        if self._compiled:
            by_row = np.zeros(len(self._confidence), np.float32)
            by_row[[row for row, _ in counts_for]] = [times for _, times in counts_for]
            held = self._confidence, self._heights, self._changed_at, self._group_changed_at
            shares = self._heights[:0] if heights is None else heights
            frame = slots, confidence, shares
            K, seed = map(
                torch.from_numpy,
                fuse_slots(_arrays(held), _arrays(frame), by_row, float(self.max_prior), revision),
            )
            self._move(slots, features, K, seed)
            return
        before = self._confidence[0, slots]
        K = gain(before.clamp(max=self.max_prior), confidence).float()
        self._move(slots, features, K, seeds(before))
        if heights is not None:
            self._move_heights(slots, heights, K)
        for row, times in counts_for:
            if times > 0:
                self._confidence[row, slots] += times * confidence
        self._set_changed(slots, revision)

    def _move(self, slots: Tensor, features: Tensor, K: Tensor, seed: Tensor) -> None:
        """Move the features of distinct slots by gains K (n,) float32 towards features (n, D)."""
        half = self._dtype == torch.float16
        if self._compiled:
            at, *parts = _arrays((slots, features, K, seed))
            for block in np.unique(at // BLOCK).tolist():
                if half:
                    bits = self._blocks[block].view(torch.int16).numpy().view(np.uint16)
                    fuse_half_rows(bits, block * BLOCK, at, *parts)
                else:
                    fuse_rows(self._blocks[block].numpy(), block * BLOCK, at, *parts[:2])
            return
        for block, chosen, within in self._by_block(slots):
            table = self._blocks[block]
            mean = fused(table[within].float(), features[chosen], K[chosen])
            table[within] = rounded(mean, seed[chosen]) if half else mean

    def _move_heights(self, slots: Tensor, shares: Tensor, K: Tensor) -> None:
        known = self._heights[slots]
        self._heights[slots] = (known + K[:, None] * (shares - known)).clamp_(min=0.0)

    def put_in(self, slots: Index, share: FeatureShare, *, revision: int) -> None:
        """Fuse a share into the slots (n,) of its cells; what was known counts in full."""
        slots = to_device(slots, self._device)
        confidence, explored = (
            part.to(self._device) for part in (share.confidence, share.explored)
        )
        before = self._confidence[0, slots]
        K = gain(before, confidence).float()
        for first in range(0, len(slots), BLOCK):  # a map in float32 would take twice its memory
            some = slice(first, first + BLOCK)
            features = share.features[some].to(self._device).float()
            self._move(slots[some], features, K[some], seeds(before[some]))
        self._move_heights(slots, to_device(share.heights, self._device), K)
        self._confidence[0, slots] += confidence
        self._confidence[EXPLORED, slots] += explored
        self._set_changed(slots, revision)

    def features(self, slots: Index) -> Tensor:
        """Features (n, D) float32 of these slots, a copy on the device."""
        slots = to_device(slots, self._device)
        gathered = torch.empty((len(slots), self.dimension), device=self._device)
        for block, chosen, within in self._by_block(slots):
            gathered[chosen] = self._blocks[block][within].float()
        return gathered

    def table(self) -> FeatureTable:
        """All features, not copied, with a copy of when they changed."""
        return replace(self._shared_table(), changed_at=self.changed_at.clone())

    def copied(self, slots: I64) -> FeatureTable:
        """A copy of the features of ascending slots, as they are stored."""
        rows = torch.empty((len(slots), self.dimension), device=self._device, dtype=self._dtype)
        bounds = np.searchsorted(slots, np.arange(len(self._blocks) + 1) * BLOCK)
        for block, (start, end) in enumerate(pairwise(bounds.tolist())):
            if start == end:
                continue
            within = to_device(slots[start:end] - block * BLOCK, self._device)
            torch.index_select(self._blocks[block], 0, within, out=rows[start:end])
        changed_at = self._changed_at[to_device(slots, self._device)]
        return FeatureTable((rows,), changed_at, self._device, self._compiled, slots, self.count)

    def chunks(self, slots: I64) -> Iterator[tuple[I64, Tensor]]:
        """As ``FeatureTable.chunks``, for as long as nothing changes."""
        return self._shared_table().chunks(slots)

    def products(self, slots: I64, vectors: Tensor) -> Tensor:
        """As ``FeatureTable.products``."""
        return self._shared_table().products(slots, vectors)

    def _shared_table(self) -> FeatureTable:
        """All features for as long as nothing changes."""
        return FeatureTable(self.blocks, self.changed_at, self._device, self._compiled)

    def doubt(self, slots: Tensor, most: float) -> None:
        """Let what is known of slots count for ``most`` at most from now on."""
        self._confidence[0, slots] = self._confidence[0, slots].clamp(max=most)

    def reset_searched(self, robot: int = 0) -> None:
        """Set sigma_E of a robot to infinity in all slots; features and their confidence stay."""
        row = self._searched_row(robot)
        self._confidence[row] = 0.0

    def set_confidence(self, row: int, confidence: Tensor) -> None:
        """Set a row (count,) of the confidences, ``SEARCHED`` or ``EXPLORED``, as of a file."""
        self._confidence[row, : self.count] = confidence.to(self._device)

    def _searched_row(self, robot: int) -> int:
        """The row of 1 / sigma_E^2 of a robot, made where it has none yet."""
        row = searched_row(robot)
        missing = row + 1 - len(self._confidence)
        if missing > 0:
            rows = self._confidence.new_zeros((missing, self._confidence.shape[1]))
            self._confidence = torch.cat([self._confidence, rows])
        return row

    def _set_changed(self, slots: Tensor, revision: int) -> None:
        self._changed_at[slots] = revision
        self._group_changed_at[slots // GROUP] = revision

    def _by_block(self, slots: Tensor) -> Iterator[tuple[int, Tensor, Tensor]]:
        """Per block with some of the slots: its number, their indices, their rows in the block.

        The host learns which blocks there are, and how many slots lie in each.
        """
        owner = slots // BLOCK
        blocks, counts = to_host(torch.stack(torch.unique(owner, return_counts=True))).tolist()
        order = torch.argsort(owner, stable=True)
        for block, chosen in zip(blocks, order.split_with_sizes(counts), strict=True):
            yield block, chosen, slots[chosen] - block * BLOCK
