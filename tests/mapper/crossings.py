"""Counts what would cross between host and accelerator, on a machine that has none."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import torch
from torch.overrides import TorchFunctionMode


class Crossings(TorchFunctionMode):
    """Bytes of tensors that are moved by ``cpu()`` to the host and by ``to(device)`` from it.

    On the CPU both are called all the same, and move nothing. Sizes of each are kept in order.
    """

    def __init__(self) -> None:
        super().__init__()
        self.to_host: list[int] = []
        self.to_device: list[int] = []

    @property
    def bytes(self) -> int:
        """Of all."""
        return sum(self.to_host) + sum(self.to_device)

    def __torch_function__(
        self,
        func: Callable[..., Any],
        types: Iterable[type],
        args: tuple[Any, ...] = (),
        kwargs: dict[str, Any] | None = None,
    ) -> Any:
        result = func(*args, **(kwargs or {}))
        if func is torch.Tensor.cpu:
            self.to_host.append(args[0].nbytes)
        elif func is torch.Tensor.to and any(isinstance(arg, torch.device) for arg in args):
            self.to_device.append(args[0].nbytes)
        elif func is torch.tensor and "device" in (kwargs or {}):
            self.to_device.append(result.nbytes)
        return result
