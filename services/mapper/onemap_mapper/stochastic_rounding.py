"""Rounding to float16 by chance, so that changes smaller than its steps are not lost.

A cell that has been seen for long moves by a few thousandths of the way to what it shows now,
which is often less than half a step of float16: rounded to the nearest it would stop on the way. A
value is rounded up as often as it lies near the upper of its two neighbours, so that it is right
on average. The chance is a hash of the cell's confidence, which grows with each view: the same
frames give the same map.
"""

from __future__ import annotations

import torch
from torch import Tensor

CUT_BITS = 13  # of a float32's mantissa, which a float16 does not have
LOW_32 = 0xFFFFFFFF
PER_CHANNEL = 0x9E3779B9  # odd, so that all channels differ
# The hash of Wellons, "lowbias32": each bit of the input changes each of the output.
FIRST, SECOND = 0x7FEB352D, 0x846CA68B


def seeds(confidence: Tensor) -> Tensor:
    """A number (n,) int64 in 32 bits for each confidence (n,) float64."""
    bits = confidence.contiguous().view(torch.int64)
    mixed: Tensor = (bits ^ (bits >> 32)) & LOW_32
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
