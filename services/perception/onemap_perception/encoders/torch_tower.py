"""Running a vision tower of torch: device, precision, memory, and what goes wrong there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from onemap_perception.encoders.protocol import EncoderError, OutOfDeviceMemoryError
from onemap_shared.geometry import F32
from onemap_shared.messages import F16, TextEmbeddings

Dense = Callable[[torch.Tensor], torch.Tensor]


@dataclass(frozen=True, slots=True)
class TowerSettings:
    """device: cpu, cuda or cuda:N; compiled: through torch.compile, minutes at start for a
    faster frame; warm_up_px: (width, height) of the camera, whose first frame then waits for
    nothing."""

    device: str = "cpu"
    compiled: bool = False
    warm_up_px: tuple[int, int] = (640, 480)


class Tower:
    """A module (1, 3, H, W) to (1, h, w, D), in half precision and channels-last on CUDA only."""

    def __init__(self, module: torch.nn.Module, settings: TowerSettings) -> None:
        self.device = open_device(settings.device)
        on_gpu = self.device.type == "cuda"
        self.dtype = torch.float16 if on_gpu else torch.float32
        self._layout = torch.channels_last if on_gpu else torch.contiguous_format
        placed: Any = module.eval().to(self.device, self.dtype)
        placed = placed.to(memory_format=self._layout)
        self._run: Dense = torch.compile(placed, dynamic=False) if settings.compiled else placed

    def __call__(self, planes: F32) -> F16:
        """Unit features (h, w, D) float16 of a picture (1, 3, H, W) float32."""
        try:
            with torch.inference_mode():
                features = self.dense(torch.from_numpy(planes))[0]
                unit = torch.nn.functional.normalize(features.float(), dim=-1)
                result: F16 = unit.half().cpu().numpy()
        except torch.OutOfMemoryError as problem:
            self._let_go()
            raise OutOfDeviceMemoryError(_out_of_memory(self.device, planes)) from problem
        except RuntimeError as problem:
            reason = str(problem).splitlines()[0]
            raise EncoderError(f"torch failed on {self.device}: {reason}") from problem
        if not np.isfinite(result).all():
            raise EncoderError(f"the encoder's features are not finite in {self.dtype}")
        return result

    def dense(self, planes: torch.Tensor) -> torch.Tensor:
        """Features (1, h, w, D) as the module gives them, on the device."""
        picture = planes.to(self.device, self.dtype, non_blocking=True)
        return self._run(picture.contiguous(memory_format=self._layout))

    def _let_go(self) -> None:
        """Give cached blocks back, so that a smaller picture or another process may fit."""
        if self.device.type == "cuda":
            torch.cuda.empty_cache()


def open_device(name: str) -> torch.device:
    """The device, or EncoderError if this machine or this torch has none of the name."""
    try:
        device = torch.device(name)
        torch.empty(1, device=device)
    except (RuntimeError, AssertionError) as problem:
        reason = str(problem).splitlines()[0]
        raise EncoderError(f"device {name!r} cannot be used: {reason}") from problem
    return device


def uncalibrated(
    texts: Sequence[str], rows: F32, *, encoder_id: str, text_space: str
) -> TextEmbeddings:
    """Queries (N, D) whose score is (1 + cosine) / 2: nothing to compare them with."""
    return TextEmbeddings(
        encoder_id=encoder_id,
        text_space=text_space,
        texts=tuple(texts),
        embeddings=rows,
        neutral=np.zeros((0, rows.shape[1]), np.float32),
        neutral_mask=np.zeros((len(texts), 0), np.uint8),
        temperature=1.0,
    )


def _out_of_memory(device: torch.device, planes: F32) -> str:
    height, width = planes.shape[2:]
    return (
        f"{device} is out of memory for a picture of {width} x {height}: "
        "lower perception.encoder.long_side_px or free the device"
    )
