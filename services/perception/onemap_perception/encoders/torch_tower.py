"""Runs the vision tower of an encoder, in torch or exported to ONNX."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import torch

from onemap_perception.encoders.exported_tower import ExportedTower
from onemap_perception.encoders.params import TowerParams
from onemap_perception.encoders.protocol import EncoderError
from onemap_perception.torch_device import inference, open_device
from onemap_shared.geometry import F16, F32

Dense = Callable[[torch.Tensor], torch.Tensor]


class Tower(Protocol):
    """Runs the vision side of an encoder."""

    def __call__(self, pixel_values: F32) -> F16:
        """Unit features (h, w, D) float16 of an image (1, 3, H, W) float32."""


class TorchTower:
    """Implements ``Tower``: a module (1, 3, H, W) to (1, h, w, D), in half
    precision and channels-last on CUDA only."""

    def __init__(self, module: torch.nn.Module, params: TowerParams) -> None:
        self.device = open_device(params.device)
        on_gpu = self.device.type == "cuda"
        self.dtype = torch.float16 if on_gpu else torch.float32
        self._layout = torch.channels_last if on_gpu else torch.contiguous_format
        self.module = module.eval()
        placed: Any = self.module.to(self.device, self.dtype)
        placed = placed.to(memory_format=self._layout)
        self._run: Dense = torch.compile(placed, dynamic=False) if params.compiled else placed

    def __call__(self, pixel_values: F32) -> F16:
        """See ``Tower``."""
        with inference(self.device, (pixel_values.shape[3], pixel_values.shape[2])):
            features = self.dense(torch.from_numpy(pixel_values))[0]
            unit = torch.nn.functional.normalize(features.float(), dim=-1)
            result: F16 = unit.half().cpu().numpy()
        if not np.isfinite(result).all():
            raise EncoderError(f"the encoder's features are not finite in {self.dtype}")
        return result

    def dense(self, pixel_values: torch.Tensor) -> torch.Tensor:
        """Features (1, h, w, D) as the module gives them, on the device."""
        image = pixel_values.to(self.device, self.dtype, non_blocking=True)
        return self._run(image.contiguous(memory_format=self._layout))


def open_tower(module: torch.nn.Module, params: TowerParams, encoder_id: str) -> Tower:
    """The module where it is to run, or its exported file; raises BackendError."""
    if params.exported is None:
        return TorchTower(module, params)
    return ExportedTower(params.exported, params.provider, encoder_id)
