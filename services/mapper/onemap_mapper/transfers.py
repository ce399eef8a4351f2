"""Arrays between the host and the device of a map's features.

On the CPU both are the same memory, and nothing is copied.
"""

from __future__ import annotations

import torch
from numpy.typing import NDArray
from torch import Tensor


def to_host(values: Tensor) -> NDArray:
    """The values as an array on the host, to be read: on the CPU it shares their memory."""
    array: NDArray = values.cpu().numpy()
    return array


def to_device(values: NDArray, device: torch.device) -> Tensor:
    """The values on a device."""
    return torch.from_numpy(values).to(device)
