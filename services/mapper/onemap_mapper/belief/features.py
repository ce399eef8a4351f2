"""Features of a map: fused in place, read for scalar products with texts.

Kernels convert float16 in registers, by arithmetic of integers. Rounding to float16 is by chance,
so that changes smaller than its steps are not lost: a cell that has been seen for long moves by a
few thousandths of the way to what it shows now, often less than half a step, and rounded to the
nearest it would stop. A value is rounded up as often as it lies near its upper neighbour. The
chance is a hash of the cell's confidence, which grows with each view: the same frames give the same
map.

A table shares the memory of the map's blocks, so that making one copies nothing, or it is a copy of
some cells. While frames are fused, rows of a shared one may be half written: whoever reads it
without the map's lock computes the cells anew that have changed since.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import Tensor

from onemap_mapper.transfers import to_device
from onemap_shared.geometry import F32, F64, I64, U16
from onemap_shared.jit import compiled, compiled_fast

CUT_BITS = 13  # of a float32's mantissa, which a float16 does not have


@compiled
def fuse_rows(table: F32, first: int, slots: I64, features: F32, K: F32) -> None:
    """Move the slots (n,) of which a table (k, D) float32 holds those from ``first`` on.

    By K (n,) towards features (n, D). As ``torch.lerp``: from whichever end is nearer, so that 0
    and 1 give the ends themselves.
    """
    for k in range(len(slots)):
        at, share = slots[k] - first, K[k]
        if at < 0 or at >= len(table):
            continue
        row, new = table[at], features[k]
        if share < 0.5:
            for channel in range(len(row)):
                row[channel] += share * (new[channel] - row[channel])
        else:
            rest = np.float32(1) - share
            for channel in range(len(row)):
                row[channel] = new[channel] - rest * (new[channel] - row[channel])


@compiled
def half_value(bits: Any) -> Any:
    """The float32 value of the 16 bits of a float16."""
    number = np.uint32(bits)
    size = np.uint32(np.uint32(number & np.uint32(0x7FFF)) << np.uint32(CUT_BITS))
    value = np.float32(size.view(np.float32) * np.float32(2.0**112))  # the exponents' biases differ
    if size >= np.uint32(31 << 23):  # infinite, or no number
        value = np.uint32(size | np.uint32(0x7F800000)).view(np.float32)
    return value if number < np.uint32(0x8000) else -value


@compiled
def half_bits(value: Any) -> Any:
    """The 16 bits of the float16 nearest to a float32, of two equally near ones the even one."""
    bits = np.float32(value).view(np.uint32)
    sign = np.uint32(np.uint32(bits >> np.uint32(16)) & np.uint32(0x8000))
    size = np.uint32(bits & np.uint32(0x7FFFFFFF))
    odd = np.uint32(np.uint32(size >> np.uint32(CUT_BITS)) & np.uint32(1))
    half = np.uint32(np.uint32(size - np.uint32(112 << 23) + np.uint32(0xFFF) + odd) >> CUT_BITS)
    # Below the smallest normal float16 a unit of its bits is one of 0.5's mantissa.
    tiny = np.uint32(np.float32(size.view(np.float32) + np.float32(0.5)).view(np.uint32))
    half = half if size >= np.uint32(113 << 23) else np.uint32(tiny - np.uint32(0x3F000000))
    half = half if size < np.uint32(143 << 23) else np.uint32(0x7C00)  # infinite
    half = half if size <= np.uint32(255 << 23) else np.uint32(0x7E00)  # no number
    return np.uint16(half | sign)


@compiled_fast
def half_products(table_bits: U16, vector: F32, out: F32) -> None:
    """out (n,) = table (n, D) times vector (D,) float32; table_bits: the float16 table's bits."""
    for k in range(len(out)):
        row = table_bits[k]
        total = np.float32(0)
        for channel in range(len(vector)):
            total += half_value(row[channel]) * vector[channel]
        out[k] = total


@compiled
def fuse_half_rows(  # noqa: PLR0917 (compiled code takes no keywords)
    table_bits: U16, first: int, slots: I64, features: F32, K: F32, seed: I64
) -> None:
    """Move slots as ``fuse_rows``, rounded as ``rounded`` does by seed (n,).

    table_bits: the float16 table's bits.
    """
    for k in range(len(slots)):
        at, share = slots[k] - first, K[k]
        if at < 0 or at >= len(table_bits):
            continue
        row, new = table_bits[at], features[k]
        start = np.uint32(seed[k])
        near, rest = share < np.float32(0.5), np.float32(1) - share
        for channel in range(len(row)):
            old = half_value(row[channel])
            step = new[channel] - old
            mean = old + share * step if near else new[channel] - rest * step
            number = np.uint32(start + np.uint32(channel) * np.uint32(0x9E3779B9))
            number = np.uint32((number ^ (number >> np.uint32(16))) * np.uint32(0x7FEB352D))
            number = np.uint32((number ^ (number >> np.uint32(15))) * np.uint32(0x846CA68B))
            number = np.uint32(number ^ (number >> np.uint32(16)))
            cut = np.uint32(np.float32(mean).view(np.uint32) + np.uint32(number >> np.uint32(19)))
            cut = np.uint32(cut & np.uint32(0xFFFFE000))  # the bits that a float16 does not have
            row[channel] = half_bits(cut.view(np.float32))


@compiled_fast
def products(table: F32, vector: F32, out: F32) -> None:
    """out (n,) = table (n, D) times vector (D,) float32."""
    for k in range(len(out)):
        row = table[k]
        total = np.float32(0)
        for channel in range(len(vector)):
            total += row[channel] * vector[channel]
        out[k] = total


LOW_32 = 0xFFFFFFFF
PER_CHANNEL = 0x9E3779B9  # odd, so that all channels differ
# The hash of Wellons, "lowbias32": each bit of the input changes each of the output.
FIRST, SECOND = 0x7FEB352D, 0x846CA68B


def seeds(confidence: F64) -> I64:
    """A number (n,) in 32 bits for each confidence (n,) float64."""
    bits = confidence.view(np.int64)
    mixed: I64 = (bits ^ (bits >> 32)) & LOW_32
    return mixed


def rounded(values: Tensor, seed: Tensor) -> Tensor:
    """Values (n, D) float32 as float16, rounded up or down by the hash of seed (n,) and channel."""
    channel = torch.arange(values.shape[1], device=values.device)
    dither = _hash((seed[:, None] + channel * PER_CHANNEL) & LOW_32) >> (32 - CUT_BITS)
    bits = values.contiguous().view(torch.int32) + dither.to(torch.int32)
    cut: Tensor = (bits & -(1 << CUT_BITS)).view(torch.float32)
    return cut.half()


def _hash(number: Tensor) -> Tensor:
    """32 bits (...) int64 of 32 bits."""
    number = (number ^ (number >> 16)) * FIRST & LOW_32
    number = (number ^ (number >> 15)) * SECOND & LOW_32
    hashed: Tensor = number ^ (number >> 16)
    return hashed


PART = 512  # rows that are multiplied at once: 1.5 MB of 768 float32 channels, in the L2 cache
FEW_VECTORS = 2  # for which reading a row anew costs less than converting it


@dataclass(frozen=True, slots=True)
class FeatureTable:
    """Features of a map's slots.

    blocks: tables of equally many rows (rows, D), float32 or float16, on ``device``; slots (n,)
    ascending, those whose features the blocks hold, None: all; changed_at (n,), the map's revision
    at which the feature of each of them last changed; of: slots of the map, if not all.
    """

    blocks: tuple[Tensor, ...]
    changed_at: I64
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
            return np.concatenate([np.flatnonzero(changed[:kept]), np.arange(kept, self.count)])
        return self.slots[changed | (self.slots >= kept)]

    def chunks(self, slots: I64) -> Iterator[tuple[I64, Tensor]]:
        """The features of ascending slots in parts: their indices, and (k, D) float32, read-only.

        Consecutive slots are not copied, so that a query over a whole map reads the memory once.
        """
        for start, table in self._ascending(slots):
            for first, part in _parts(table):
                yield np.arange(start + first, start + first + len(part)), part

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
    if compiled and len(vectors) <= FEW_VECTORS:
        for vector, out in zip(vectors, found, strict=True):
            query = vector.contiguous().numpy()
            if half:
                bits = table.view(torch.int16).numpy().view(np.uint16)
                half_products(bits, query, out.numpy())
            else:
                products(table.numpy(), query, out.numpy())
        return
    for start, part in _parts(table):
        torch.mm(vectors, part.T, out=found[:, start : start + len(part)])


def _parts(table: Tensor) -> Iterator[tuple[int, Tensor]]:
    """A table (n, D) in parts that fit into the CPU's cache, float32; where each begins."""
    rows = PART if table.device.type == "cpu" else max(len(table), 1)
    for start in range(0, len(table), rows):
        yield start, table[start : start + rows].float()


NOTHING_KNOWN = (-1, 0)  # before any revision, of no cell
RESERVE = 1.5  # times what is needed, so that growing by a frame's cells rarely copies


class SlotValues:
    """``rows`` float32 numbers for each slot, 0 for new ones.

    revision: of the map at which they were computed, -1: none yet.
    """

    def __init__(self, rows: int, device: torch.device) -> None:
        self._held = torch.zeros((rows, 0), device=device)
        self._count = 0
        self.revision = NOTHING_KNOWN[0]

    @property
    def known(self) -> tuple[int, int]:
        """Of which revision of the map, and of how many first slots, they are."""
        return self.revision, self._count

    @property
    def nbytes(self) -> int:
        return self._held.nbytes

    @property
    def values(self) -> Tensor:
        """The numbers (rows, count), not copied: writing to them changes these."""
        return self._held[:, : self._count]

    def resize(self, count: int) -> None:
        """Make it this many slots."""
        if count > self._held.shape[1]:
            reserved = int(count * RESERVE) if self._count else count
            held = self._held.new_zeros((len(self._held), reserved))
            held[:, : self._count] = self.values
            self._held = held
        self._held[:, self._count : count] = 0.0
        self._count = count
