"""Reads the features of a map: scalar products with texts, and the features themselves.

A table shares the memory of the map's blocks, so that making one copies nothing, or it is a copy
of some cells. While frames are fused, rows of a shared one may be half written: whoever reads it
without the map's lock computes the cells anew that have changed since.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from onemap_mapper.kernels import half_rows, row_products
from onemap_mapper.transfers import to_device, to_host
from onemap_shared.geometry import I64

PART = 512  # rows that are multiplied at once: 1.5 MB of 768 float32 channels, in the L2 cache
FEW_VECTORS = 2  # for which reading a row anew costs less than converting it


class CellFeatures(Protocol):
    """What scores are computed of: the features of a map's slots and when each changed."""

    @property
    def count(self) -> int:
        """Slots of the map."""
        ...

    @property
    def device(self) -> torch.device:
        """Where the features are."""
        ...

    def changed_since(self, revision: int, kept: int) -> I64:
        """As ``FeatureTable.changed_since``."""
        ...

    def chunks(self, slots: I64) -> Iterator[tuple[I64, Tensor]]:
        """As ``FeatureTable.chunks``."""
        ...

    def products(self, slots: I64, vectors: Tensor) -> Tensor:
        """As ``FeatureTable.products``."""
        ...


@dataclass(frozen=True, slots=True)
class FeatureTable:
    """Features of a map's slots.

    blocks: tables of equally many rows (rows, D), float32 or float16, on ``device``; slots (n,)
    ascending, those whose features the blocks hold, None: all; changed_at (n,) int64, on
    ``device`` too, the map's revision at which the feature of each of them last changed; of: slots
    of the map, if not all.
    """

    blocks: tuple[Tensor, ...]
    changed_at: Tensor
    device: torch.device
    compiled: bool
    slots: I64 | None = None
    of: int = 0

    @property
    def count(self) -> int:
        """Slots of the map, with those whose features are not in this table."""
        return len(self.changed_at) if self.slots is None else self.of

    def changed_since(self, revision: int, kept: int) -> I64:
        """Ascending slots (n,) that changed after this revision, or are not among the kept first.

        Only those whose features are in this table.
        """
        changed = self.changed_at > revision
        if self.slots is None:
            kept = min(kept, self.count)
            older = to_host(torch.nonzero(changed[:kept]).squeeze(1))
            return np.concatenate([older, np.arange(kept, self.count)])
        return self.slots[to_host(changed) | (self.slots >= kept)]

    def chunks(self, slots: I64) -> Iterator[tuple[I64, Tensor]]:
        """The features of ascending slots in parts: their indices, and (k, D) float32, read-only.

        Consecutive slots are not copied, so that a query over a whole map reads the memory once.
        """
        for start, part in self._ascending(slots):
            yield np.arange(start, start + len(part)), part.float()

    def products(self, slots: I64, vectors: Tensor) -> Tensor:
        """Scalar products (T, n) float32 of vectors (T, D) float32 with ascending slots' features.

        A table of float16 is not converted as a whole: in registers for one or two vectors, for
        more in parts that stay in the cache.
        """
        found = torch.empty((len(vectors), len(slots)), device=self.device)
        for start, part in self._ascending(slots):
            _multiply(part, vectors, found[:, start : start + len(part)], self.compiled)
        return found

    def _ascending(self, slots: I64) -> Iterator[tuple[int, Tensor]]:
        """The tables of ascending slots in parts, not copied if consecutive; where each begins."""
        if not self.blocks:
            return
        rows = slots if self.slots is None else np.searchsorted(self.slots, slots)
        size = len(self.blocks[0])
        bounds = np.searchsorted(rows, np.arange(len(self.blocks) + 1) * size)
        for block, (start, end) in enumerate(pairwise(bounds.tolist())):
            if start == end:
                continue
            within, table = rows[start:end] - block * size, self.blocks[block]
            first, last = int(within[0]), int(within[-1])
            together = last - first + 1 == end - start
            if together:
                yield start, table[first : last + 1]
            else:
                yield start, table[to_device(within, self.device)]


def _multiply(table: Tensor, vectors: Tensor, found: Tensor, compiled: bool) -> None:
    """found (T, n) float32 = vectors (T, D) float32 times table (n, D)^T, float32 or float16."""
    half = table.dtype == torch.float16
    if compiled and len(vectors) <= FEW_VECTORS and (half_rows.HALF or not half):
        for vector, out in zip(vectors, found, strict=True):
            query = vector.contiguous().numpy()
            if half:
                bits = table.view(torch.int16).numpy().view(np.uint16)
                half_rows.half_products(bits, query, out.numpy())
            else:
                row_products.products(table.numpy(), query, out.numpy())
        return
    rows = PART if table.device.type == "cpu" else len(table)
    for start in range(0, len(table), rows):
        part = table[start : start + rows].float()
        torch.mm(vectors, part.T, out=found[:, start : start + rows])
