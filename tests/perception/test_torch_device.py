"""What torch raises becomes one sentence."""

from __future__ import annotations

import pytest
import torch

from onemap_perception.errors import Fault, OutOfDeviceMemoryError
from onemap_perception.torch_device import open_device, running

CPU = torch.device("cpu")


def test_errors_of_torch_become_faults() -> None:
    failed = "the network failed on cpu: size mismatch"
    with pytest.raises(Fault, match=failed), running(CPU, (4, 3)):
        raise RuntimeError("size mismatch\nand a long story")
    full = "cpu is out of memory for a picture of 4 x 3"
    with pytest.raises(OutOfDeviceMemoryError, match=full), running(CPU, (4, 3)):
        raise torch.OutOfMemoryError("no more")


def test_other_errors_stay_what_they_are() -> None:
    with pytest.raises(KeyError), running(CPU, (4, 3)):
        raise KeyError("a bug")


def test_nothing_inside_is_differentiated() -> None:
    with running(CPU, (4, 3)):
        assert torch.is_inference_mode_enabled()


@pytest.mark.parametrize("name", ["toaster", "cuda:99"])
def test_a_device_that_is_not_there_is_told(name: str) -> None:
    with pytest.raises(Fault, match=f"device '{name}' cannot be used"):
        open_device(name)
