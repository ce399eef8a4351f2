"""A device that a machine without one can pretend to have, and a count of what crosses to it.

A tensor on it says so, cannot be read by NumPy, and cannot be used with one on the host, as on a
GPU. It is computed on the CPU all the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.overrides import TorchFunctionMode

DEVICE = torch.device("cpu", 0)  # another one than torch.device("cpu"), that of the host
NUMBER = 8  # bytes of a number that the host reads
READ = {
    getattr(Tensor, name)
    for name in ("item", "tolist", "__bool__", "__int__", "__float__", "__index__")
}
DEVICE_OF = Tensor.device.__get__
# The host waits for the size of what they return.
SIZED = {torch.nonzero, Tensor.nonzero, torch.unique, Tensor.unique}


class DeviceTensor(Tensor):
    """A tensor on the device."""


class WrongDevice(RuntimeError):
    """Tensors of the host and of the device were used together, or one was read where it is not."""


class Crossings(TorchFunctionMode):
    """While it is entered there is the device ``DEVICE``; counts what crosses, in order, in bytes.

    ``waits``: how often the host had to know the size of a result before it could go on.
    """

    def __init__(self) -> None:
        super().__init__()
        self.to_host: list[int] = []
        self.to_device: list[int] = []
        self.waits = 0

    def clear(self) -> None:
        """Count anew."""
        self.to_host, self.to_device, self.waits = [], [], 0

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
        kwargs = kwargs or {}
        own = bool(args) and isinstance(args[0], DeviceTensor)
        with torch._C.DisableTorchFunctionSubclass():
            if func == DEVICE_OF:
                return DEVICE if own else func(*args)
            if func is Tensor.cpu:
                return self._to_host(args[0]) if own else func(*args)
            if func is Tensor.to and DEVICE in (*args[1:], *kwargs.values()):
                return args[0] if own else self._to_device(func(args[0]))
            if kwargs.get("device") == DEVICE and kwargs["device"].index is not None:
                made = func(*args, **kwargs)
                if func is torch.tensor:
                    return self._to_device(made)
                return made.as_subclass(DeviceTensor)
            return self._computed(func, args, kwargs)

    def _computed(self, func: Callable[..., Any], args: Any, kwargs: dict[str, Any]) -> Any:
        name = getattr(func, "__name__", str(func))
        tensors = [each for each in _leaves((args, kwargs)) if isinstance(each, Tensor)]
        on_device = any(isinstance(each, DeviceTensor) for each in tensors)
        if not on_device:
            return func(*args, **kwargs)
        if func in (Tensor.numpy, Tensor.__array__):
            raise WrongDevice("the host reads a tensor of the device")
        for each in _leaves((args, kwargs)):
            host = isinstance(each, Tensor) and not isinstance(each, DeviceTensor) and each.ndim
            if host or (isinstance(each, np.ndarray) and each.ndim):
                raise WrongDevice(f"{name} of tensors of the host and of the device")
        if func in READ:
            self.to_host.append(NUMBER * max(1, args[0].numel()))
        masks = [each for each in _leaves(args[1:]) if getattr(each, "dtype", None) is torch.bool]
        self.waits += func in SIZED or (func is Tensor.__getitem__ and bool(masks))
        return _on_device(func(*args, **kwargs))

    def _to_host(self, values: Tensor) -> Tensor:
        self.to_host.append(values.nbytes)
        return values.as_subclass(Tensor)

    def _to_device(self, values: Tensor) -> Tensor:
        if values.nbytes:
            self.to_device.append(values.nbytes)
        return values.as_subclass(DeviceTensor)


def _leaves(values: Any) -> Iterator[Any]:
    """All that is in nested lists, tuples and dicts."""
    if isinstance(values, dict):
        values = values.values()
    if isinstance(values, (list, tuple)) or type(values) is type({}.values()):
        for each in values:
            yield from _leaves(each)
    else:
        yield values


def _on_device(result: Any) -> Any:
    """The tensors of a result as those of the device."""
    if isinstance(result, Tensor):
        return result.as_subclass(DeviceTensor)
    if isinstance(result, (list, tuple)):  # with those that name their elements, as of torch.sort
        return type(result)([_on_device(each) for each in result])
    return result
