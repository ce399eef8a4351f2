"""Opens torch devices and turns the errors of inference into BackendError."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from onemap_perception.errors import BackendError, OutOfDeviceMemoryError


def open_device(name: str) -> torch.device:
    """The device; raises BackendError if this machine or this torch has none of the name."""
    try:
        device = torch.device(name)
        torch.empty(1, device=device)
    except (RuntimeError, AssertionError) as problem:
        reason = str(problem).splitlines()[0]
        raise BackendError(f"device {name!r} cannot be used: {reason}") from problem
    return device


@contextmanager
def inference(device: torch.device, image_px: tuple[int, int]) -> Iterator[None]:
    """Inference on an image of (width, height); errors of torch become BackendError.

    If the device is full its cached blocks are freed, so that the next image may fit.
    """
    width, height = image_px
    try:
        with torch.inference_mode():
            yield
    except torch.OutOfMemoryError as problem:
        if device.type == "cuda":
            torch.cuda.empty_cache()
        raise OutOfDeviceMemoryError(
            f"{device} is out of memory for an image of {width} x {height}: "
            "feed smaller images or free the device"
        ) from problem
    except (RuntimeError, ValueError, IndexError) as problem:  # of torch and transformers
        reason = (str(problem).strip() or repr(problem)).splitlines()[0]
        raise BackendError(f"the network failed on {device}: {reason}") from problem
