"""The belief of every observed cell: its feature and its three confidences.

Cells are packed in order of first observation ("slots"), so memory is proportional to the
observed area. Features lie in blocks, so that growing never copies them. Only they are on the
device: confidences, 24 bytes per cell, are on the host, where replies read all of them, so that
a frame moves those of its own cells.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf

import numpy as np
import torch
from torch import Tensor

from onemap_mapper.feature_table import FeatureTable
from onemap_mapper.fusion import fused, gain, with_process_noise
from onemap_mapper.heights import HeightStore
from onemap_mapper.kernels import half_rows, jit
from onemap_mapper.kernels.fuse_rows import fuse_rows
from onemap_mapper.kernels.half_rows import fuse_half_rows
from onemap_mapper.keyframes import ONE_VIEW, Views
from onemap_mapper.stochastic_rounding import rounded, seeds
from onemap_shared.geometry import F32, I64, Bool

BLOCK = 4096  # cells: 12 MB of 768 float32 channels is allocated at a time
SEARCHED, EXPLORED = 1, 2  # rows of the confidences, after c itself
GROUP = 64  # slots, whose newest change is kept: a frame's cells lie in some dozens of groups
RESERVE = 1.25  # times what there was, so that a large map is not copied for every block
# What remains of a cell is cleared below this share of its confidence: rounding errors of its
# feature grow with the inverse of what remains, and would become as large as the feature.
EMPTY_BELOW = {torch.float32: 1e-5, torch.float16: 2e-2}


def searched_row(robot: int) -> int:
    """The row of the confidences that holds 1 / sigma_E^2 of a robot, if there are so many."""
    return SEARCHED if robot == 0 else EXPLORED + robot


@dataclass(frozen=True, slots=True)
class FeatureShare:
    """What some frames contribute to cells.

    cells (n, 2) int64 distinct world cells; features (n, D), their confidence-weighted mean, in
    any precision; confidence, searched and explored (n,) float64, the sums of c, of that of
    keyframes since the reset, and of that of all keyframes; heights (n, LEVELS) float32, shares.
    """

    cells: I64
    features: Tensor
    confidence: Tensor
    searched: Tensor
    explored: Tensor
    heights: F32

    @property
    def nbytes(self) -> int:
        """Bytes of the arrays."""
        tensors = (self.features, self.confidence, self.searched, self.explored)
        held = sum(each.numel() * each.element_size() for each in tensors)
        return self.cells.nbytes + self.heights.nbytes + held

    def only(self, chosen: Bool | I64) -> FeatureShare:
        """The share of some of the cells, by mask (n,) or by index."""
        index = torch.from_numpy(chosen)
        parts = (self.features, self.confidence, self.searched, self.explored)
        features, confidence, searched, explored = (part[index] for part in parts)
        return FeatureShare(
            self.cells[chosen], features, confidence, searched, explored, self.heights[chosen]
        )


class CellStore:
    """The slots of one map; device and dtype of the features are fixed at construction."""

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
        # second for a further robot each, once it has one. In float64, so that what is taken out
        # again leaves nothing.
        self._confidence = torch.zeros((3, 0), dtype=torch.float64)
        self._cells = np.zeros((0, 2), np.int64)
        self._changed_at = np.zeros(0, np.int64)
        self._group_changed_at = np.zeros(0, np.int64)  # the newest of each group of slots
        self._heights = HeightStore()

    @property
    def nbytes(self) -> int:
        """Bytes held on host and device, with those reserved for growth."""
        tensors = [*self._blocks, self._confidence]
        held = sum(tensor.numel() * tensor.element_size() for tensor in tensors)
        cells = (self._cells, self._changed_at, self._group_changed_at, self._heights)
        return held + sum(array.nbytes for array in cells)

    @property
    def blocks(self) -> tuple[Tensor, ...]:
        """The tables (BLOCK, D) of features, as they are stored; not to be written."""
        return tuple(self._blocks)

    @property
    def cells(self) -> I64:
        """World cells (count, 2) of the slots."""
        return self._cells[: self.count]

    @property
    def changed_at(self) -> I64:
        """Map revision (count,) at which each slot's feature last changed."""
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
    def confidence(self) -> Tensor:
        """c = 1 / sigma^2 (count,) float32 > 0, on the host as all confidences."""
        return self._confidence[0, : self.count].float()

    @property
    def searched_confidence(self) -> Tensor:
        """1 / sigma_E^2 (count,) float32 >= 0, of keyframes since the last reset."""
        return self._confidence[1, : self.count].float()

    @property
    def explored_confidence(self) -> Tensor:
        """c (count,) float32 >= 0 of keyframes only."""
        return self._confidence[2, : self.count].float()

    def confidences(self, part: slice | I64) -> Tensor:
        """The confidences (3 + further robots, k) float32 of these slots, as above."""
        return self._confidence[:, part].float()

    @property
    def all_heights(self) -> F32:
        """Shares (count, LEVELS) of height of all slots; not to be written."""
        return self._heights.first(self.count)

    def heights(self, slots: I64 | slice) -> F32:
        """Shares (n, LEVELS) float32 of height of these slots, a copy."""
        return self._heights.of(slots)

    def add(self, cells: I64) -> I64:
        """New slots (n,) for world cells (n, 2) that have none."""
        slots = np.arange(self.count, self.count + len(cells))
        self.count += len(cells)
        while len(self._blocks) * BLOCK < self.count:
            shape = (BLOCK, self.dimension)
            self._blocks.append(torch.zeros(shape, device=self._device, dtype=self._dtype))
        if self.count > len(self._cells):
            reserved = max(len(self._blocks) * BLOCK, int(len(self._cells) * RESERVE))
            extra = reserved - len(self._cells)
            self._cells = np.concatenate([self._cells, np.zeros((extra, 2), np.int64)])
            self._changed_at = np.concatenate([self._changed_at, np.zeros(extra, np.int64)])
            groups = -(-reserved // GROUP) - len(self._group_changed_at)
            self._group_changed_at = np.pad(self._group_changed_at, (0, groups))
            grown = self._confidence.new_zeros((len(self._confidence), extra))
            self._confidence = torch.cat([self._confidence, grown], dim=1)
            self._heights.reserve(reserved)
        self._cells[slots] = cells
        return slots

    def keep_every_view(self) -> None:
        """Let no view fade from now on, and convert to float32, so that ``take_out`` is exact."""
        self.max_prior, self._dtype = inf, torch.float32
        self._blocks = [block.float() for block in self._blocks]

    def fuse(
        self,
        slots: I64,
        features: Tensor,
        confidence: Tensor,
        *,
        revision: int,
        views: Views = ONE_VIEW,
        heights: F32 | None = None,
    ) -> None:
        """Fuse an observation, features (n, D) and confidence (n,) float32, into distinct slots.

        views: how often it counts for searched and explored; heights (n, LEVELS): its shares of
        height, None if they are not known.
        """
        index, confidence = torch.from_numpy(slots), confidence.cpu()
        known = self._confidence[0, index].clamp(max=self.max_prior)
        K = gain(known, confidence).float()
        self._move(slots, features, K)
        if heights is not None:
            self._heights.move(slots, heights, K.numpy())
        searched = self._searched_row(views.robot)
        for row, times in ((0, 1.0), (searched, views.searched), (EXPLORED, views.explored)):
            if times > 0:
                self._confidence[row, index] += times * confidence
        self._set_changed(slots, revision)

    def _move(self, slots: I64, features: Tensor, K: Tensor) -> None:
        """Move the features of distinct slots by gains K (n,) float32 towards features (n, D)."""
        seed = seeds(self._confidence[0, torch.from_numpy(slots)]).to(self._device)
        K = K.to(self._device)
        for block, chosen, within in self._by_block(slots):
            table = self._blocks[block]
            if self._compiled and self._dtype == torch.float32:
                parts = (table, within, features, chosen, K)
                fuse_rows(*(part.contiguous().numpy() for part in parts))
            elif self._compiled and half_rows.HALF:
                bits = table.view(torch.int16).numpy().view(np.uint16)
                rows, gains = features.contiguous().numpy(), K.contiguous().numpy()
                moves = (rows, chosen.numpy(), gains, seed.contiguous().numpy())
                fuse_half_rows(bits, within.numpy(), moves)
            else:
                mean = fused(table[within].float(), features[chosen], K[chosen])
                half = self._dtype == torch.float16
                table[within] = rounded(mean, seed[chosen]) if half else mean

    def share(self, dtype: torch.dtype) -> FeatureShare:
        """A copy of all content, on the CPU, with features in ``dtype``."""
        features = self.features(np.arange(self.count)).cpu().to(dtype)
        confidence, searched, explored = self._confidence[:, : self.count].clone()
        heights = self.heights(slice(0, self.count))
        return FeatureShare(self.cells.copy(), features, confidence, searched, explored, heights)

    def put_in(self, slots: I64, share: FeatureShare, *, revision: int) -> None:
        """Fuse a share into the slots (n,) of its cells; what was known counts in full."""
        index = torch.from_numpy(slots)
        parts = (share.confidence, share.searched, share.explored)
        K = gain(self._confidence[0, index], parts[0])
        self._move(slots, share.features.to(self._device).float(), K.float())
        self._heights.move(slots, share.heights, K.float().numpy())
        for row, part in enumerate(parts):
            self._confidence[row, index] += part
        self._set_changed(slots, revision)

    def take_out(self, slots: I64, share: FeatureShare, *, revision: int) -> Bool:
        """Undo ``put_in``; returns (n,) bool: nothing remains of the slot, which is now zero.

        Fusing with the gain -c_s / (c - c_s) gives (c F - c_s F_s) / (c - c_s).
        """
        index = torch.from_numpy(slots)
        before, taken = self._confidence[0, index], share.confidence
        rest = before - taken
        empty = rest <= EMPTY_BELOW[self._dtype] * before
        K = torch.where(empty, 0.0, -taken / rest)
        features = share.features.to(self._device).float()
        gains, kept = K.float().to(self._device), (~empty).to(self._device)
        for block, chosen, within in self._by_block(slots):
            table = self._blocks[block]
            left = fused(table[within].float(), features[chosen], gains[chosen])
            table[within] = (left * kept[chosen, None]).to(self._dtype)
        self._confidence[0, index] = torch.where(empty, 0.0, rest)
        for row, part in enumerate((share.searched, share.explored), start=1):
            left = (self._confidence[row, index] - part).clamp(min=0.0)
            self._confidence[row, index] = torch.where(empty, 0.0, left)
        self._set_changed(slots, revision)
        emptied: Bool = empty.numpy()
        self._heights.move(slots, share.heights, K.float().numpy())
        self._heights.clear(slots[emptied])
        return emptied

    def remove(self, slots: I64, *, revision: int) -> I64:
        """Remove distinct slots; returns the slots (k,) that were filled again, with the last ones.

        The other slots keep their numbers.
        """
        gone = np.zeros(self.count, bool)
        gone[slots] = True
        count = self.count - len(slots)
        to, last = np.flatnonzero(gone[:count]), count + np.flatnonzero(~gone[count:])
        features = self.features(last)
        for block, chosen, within in self._by_block(to):
            self._blocks[block][within] = features[chosen].to(self._dtype)
        into, moved = (torch.from_numpy(each) for each in (to, last))
        self._confidence[:, into] = self._confidence[:, moved]
        self._confidence[:, count : self.count] = 0.0
        self._heights.put(to, self._heights.of(last))
        self._heights.clear(np.arange(count, self.count))
        self._cells[to] = self._cells[last]
        self._set_changed(to, revision)
        self.count = count
        return to

    def features(self, slots: I64) -> Tensor:
        """Features (n, D) float32 of these slots, a copy."""
        gathered = torch.empty((len(slots), self.dimension), device=self._device)
        for block, chosen, within in self._by_block(slots):
            gathered[chosen] = self._blocks[block][within].float()
        return gathered

    def table(self) -> FeatureTable:
        """All features, not copied, with a copy of when they changed."""
        return replace(self._shared_table(), changed_at=self.changed_at.copy())

    def copied(self, slots: I64) -> FeatureTable:
        """A copy of the features of ascending slots, as they are stored."""
        rows = torch.empty((len(slots), self.dimension), device=self._device, dtype=self._dtype)
        bounds = np.searchsorted(slots, np.arange(len(self._blocks) + 1) * BLOCK)
        for block, (start, end) in enumerate(pairwise(bounds.tolist())):
            if start == end:
                continue
            within = torch.from_numpy(slots[start:end] - block * BLOCK).to(self._device)
            torch.index_select(self._blocks[block], 0, within, out=rows[start:end])
        changed_at = self._changed_at[slots]
        return FeatureTable((rows,), changed_at, self._device, self._compiled, slots, self.count)

    def chunks(self, slots: I64) -> Iterator[tuple[I64, Tensor]]:
        """As ``FeatureTable.chunks``."""
        return self._shared_table().chunks(slots)

    def products(self, slots: I64, vectors: Tensor) -> Tensor:
        """As ``FeatureTable.products``."""
        return self._shared_table().products(slots, vectors)

    def _shared_table(self) -> FeatureTable:
        """All features for as long as nothing changes."""
        return FeatureTable(self.blocks, self.changed_at, self._device, self._compiled)

    def add_process_noise(self, *, rate_per_s: float, elapsed_s: float) -> None:
        """Add ``rate_per_s * elapsed_s`` to every variance."""
        self._confidence = with_process_noise(
            self._confidence, rate_per_s=rate_per_s, elapsed_s=elapsed_s
        )

    def doubt(self, slots: I64, most: float) -> None:
        """Let what is known of distinct slots count for ``most`` at most from now on."""
        index = torch.from_numpy(slots)
        self._confidence[0, index] = self._confidence[0, index].clamp(max=most)

    def reset_searched(self, robot: int = 0) -> None:
        """Set sigma_E of a robot to infinity in all slots; features and their confidence stay."""
        row = self._searched_row(robot)
        self._confidence[row] = 0.0

    def set_searched_confidence(self, confidence: Tensor) -> None:
        """Set 1 / sigma_E^2 (count,) of all slots, as loaded from a file."""
        self._confidence[SEARCHED, : self.count] = confidence.cpu()

    def set_explored_confidence(self, confidence: Tensor) -> None:
        """Set the confidence of keyframes (count,) of all slots, as loaded from a file."""
        self._confidence[EXPLORED, : self.count] = confidence.cpu()

    def _searched_row(self, robot: int) -> int:
        """The row of 1 / sigma_E^2 of a robot, made where it has none yet."""
        row = searched_row(robot)
        missing = row + 1 - len(self._confidence)
        if missing > 0:
            rows = self._confidence.new_zeros((missing, self._confidence.shape[1]))
            self._confidence = torch.cat([self._confidence, rows])
        return row

    def _set_changed(self, slots: I64, revision: int) -> None:
        self._changed_at[slots] = revision
        self._group_changed_at[slots // GROUP] = revision

    def _by_block(self, slots: I64) -> Iterator[tuple[int, Tensor, Tensor]]:
        """Per block with some of the slots: its number, their indices, their rows in the block."""
        owner = slots // BLOCK
        for block in np.unique(owner):
            chosen = np.nonzero(owner == block)[0]
            within = slots[chosen] - block * BLOCK
            yield (
                int(block),
                torch.from_numpy(chosen).to(self._device),
                torch.from_numpy(within).to(self._device),
            )
