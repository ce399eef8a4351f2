"""What torch raises becomes one sentence."""

from __future__ import annotations

import pytest
import torch

from onemap_perception.encoders.checkpoint import inference, open_device
from onemap_perception.errors import BackendError, OutOfDeviceMemoryError

CPU = torch.device("cpu")


def test_errors_of_torch_become_backend_errors() -> None:
    failed = "the network failed on cpu: size mismatch"
    with pytest.raises(BackendError, match=failed), inference(CPU, (4, 3)):
        raise RuntimeError("size mismatch\nand a long story")
    full = "cpu is out of memory for an image of 4 x 3"
    with pytest.raises(OutOfDeviceMemoryError, match=full), inference(CPU, (4, 3)):
        raise torch.OutOfMemoryError("no more")


def test_other_errors_stay_what_they_are() -> None:
    with pytest.raises(KeyError), inference(CPU, (4, 3)):
        raise KeyError("a bug")


def test_nothing_inside_is_differentiated() -> None:
    with inference(CPU, (4, 3)):
        assert torch.is_inference_mode_enabled()


@pytest.mark.parametrize("name", ["toaster", "cuda:99"])
def test_a_device_that_does_not_exist_is_an_error(name: str) -> None:
    with pytest.raises(BackendError, match=f"device '{name}' cannot be used"):
        open_device(name)
