"""A vision tower in torch: unit features, and errors of the network."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from onemap_perception.encoders.protocol import EncoderError
from onemap_perception.encoders.torch_encoder import TorchTower
from onemap_perception.errors import OutOfDeviceMemoryError


class Channels(torch.nn.Module):
    """Each pixel's channels, times ``factor``."""

    def __init__(self, factor: float = 1.0) -> None:
        super().__init__()
        self.factor = factor

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        return image.permute(0, 2, 3, 1) * self.factor


PIXELS = np.random.default_rng(0).random((1, 3, 4, 5)).astype(np.float32) + 0.1


def test_features_are_normalised_in_half_precision() -> None:
    features = TorchTower(Channels(7.0), "cpu")(PIXELS)
    assert features.dtype == np.float16
    expected = PIXELS[0].transpose(1, 2, 0)
    expected = expected / np.linalg.norm(expected, axis=-1, keepdims=True)
    np.testing.assert_allclose(features, expected, atol=1e-3)


def test_features_that_are_not_finite_are_an_error() -> None:
    with pytest.raises(EncoderError, match=r"not finite in torch\.float32"):
        TorchTower(Channels(float("nan")), "cpu")(PIXELS)


def test_a_full_device_is_an_error_of_one_image() -> None:
    class Full(torch.nn.Module):
        def forward(self, image: torch.Tensor) -> torch.Tensor:
            raise torch.OutOfMemoryError("Tried to allocate 2.00 GiB")

    tower = TorchTower(Full(), "cpu")
    with pytest.raises(OutOfDeviceMemoryError, match="out of memory for an image of 5 x 4"):
        tower(PIXELS)


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA device")
def test_on_cuda_the_tower_runs_in_half_precision() -> None:
    tower = TorchTower(Channels(), "cuda")
    assert tower.dtype == torch.float16
    on_cpu = TorchTower(Channels(), "cpu")
    np.testing.assert_allclose(tower(PIXELS), on_cpu(PIXELS), atol=2e-3)
