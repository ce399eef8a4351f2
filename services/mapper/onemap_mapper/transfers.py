"""Arrays between the host and the device of a map.

On the CPU both are the same memory, and nothing is copied.
"""

from __future__ import annotations

from typing import TypeAlias

import torch
from numpy.typing import NDArray
from torch import Tensor

from onemap_shared.geometry import I64

CPU = torch.device("cpu")
Index: TypeAlias = I64 | Tensor  # numbers (n,) int64 of rows or slots, on the host or the device


def to_host(values: Tensor) -> NDArray:
    """The values as an array on the host, to be read: on the CPU it shares their memory."""
    array: NDArray = values.cpu().numpy()
    return array


def to_device(values: NDArray | Tensor, device: torch.device) -> Tensor:
    """The values on a device; what is there already is not copied."""
    return (values if isinstance(values, Tensor) else torch.from_numpy(values)).to(device)
