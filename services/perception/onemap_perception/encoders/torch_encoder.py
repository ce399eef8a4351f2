"""Encoders of two towers in torch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from onemap_perception.config import SHIPPED, TorchParams
from onemap_perception.encoders.checkpoint import inference, open_device
from onemap_perception.encoders.images import (
    fitted_size,
    framed,
    mean_feature,
    patch_shares,
    pixel_values,
    resized,
)
from onemap_perception.errors import BackendError
from onemap_perception.text.competition import Competition
from onemap_perception.text.embeddings import CachedTextEncoder, EmbedTexts, uncalibrated_queries
from onemap_perception.text.queries import IMAGE_NAME
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.geometry import F16, F32, U8
from onemap_shared.messages import TextEmbeddings

CAMERA_PX = (640, 480)  # width and height of the image encoded at start: the first frame is as fast
PROMPT = "a {}"  # the paper's; {} stands for the text of the query
TEXT_CACHE_SIZE = 1024  # embeddings of texts kept: 3 MB at 768 numbers

Dense = Callable[[torch.Tensor], torch.Tensor]


class TorchTower:
    """Runs a module (1, 3, H, W) to (1, h, w, D), in half precision and channels-last on CUDA
    only."""

    def __init__(self, module: torch.nn.Module, device: str) -> None:
        self.device = open_device(device)
        on_gpu = self.device.type == "cuda"
        self.dtype = torch.float16 if on_gpu else torch.float32
        self._layout = torch.channels_last if on_gpu else torch.contiguous_format
        self.module = module.eval()
        placed: Any = self.module.to(self.device, self.dtype)
        self._run: Dense = placed.to(memory_format=self._layout)

    def __call__(self, pixel_values: F32) -> F16:
        """Unit features (h, w, D) float16 of an image (1, 3, H, W) float32."""
        with inference(self.device, (pixel_values.shape[3], pixel_values.shape[2])):
            features = self.dense(torch.from_numpy(pixel_values))[0]
            unit = torch.nn.functional.normalize(features.float(), dim=-1)
            result: F16 = unit.half().cpu().numpy()
        if not np.isfinite(result).all():
            raise BackendError(f"the encoder's features are not finite in {self.dtype}")
        return result

    def dense(self, pixel_values: torch.Tensor) -> torch.Tensor:
        """Features (1, h, w, D) as the module gives them, on the device."""
        image = pixel_values.to(self.device, self.dtype, non_blocking=True)
        return self._run(image.contiguous(memory_format=self._layout))


NO_MEAN: F32 = np.zeros(3, np.float32)
NO_STD: F32 = np.ones(3, np.float32)


@dataclass(frozen=True, slots=True)
class VisionLanguageModel:
    """A loaded checkpoint.

    vision: images (1, 3, H, W) to features (1, H / stride_px, W / stride_px, D), not normalised;
    embed: prompts to rows (N, D), not normalised. mean, std (3,): of the channels in [0, 1].
    temperature: factor of the cosine that it was trained with; None: the checkpoint has none.
    """

    encoder_id: str
    text_space: str
    vision: torch.nn.Module
    embed: EmbedTexts
    stride_px: int
    mean: F32
    std: F32
    temperature: float | None = None


class TorchEncoder:
    """Implements ``Encoder`` for a loaded model; encodes one image at once to warm up."""

    def __init__(self, model: VisionLanguageModel, params: TorchParams) -> None:
        self.encoder_id = model.encoder_id
        self.text_space = model.text_space
        self.tower = TorchTower(model.vision, params.device)
        self._stride_px = model.stride_px
        self._mean, self._std = model.mean, model.std
        self._params = params
        self._texts = CachedTextEncoder(model.embed, prompt=PROMPT, capacity=TEXT_CACHE_SIZE)
        self._competition = Competition(load_vocabulary(SHIPPED), self._texts, model.temperature)
        width, height = CAMERA_PX
        self.encode(np.zeros((height, width, 3), np.uint8))

    def prepare(self, rgb: U8) -> F32:
        """The tower's input (1, 3, H, W) float32 for an image."""
        size = fitted_size(
            rgb.shape[1],
            rgb.shape[0],
            long_side_px=self._params.long_side_px,
            stride=self._stride_px,
        )
        return pixel_values(resized(rgb, size), self._mean, self._std)

    def encode(self, rgb: U8) -> F16:
        """See ``Encoder``; one patch per ``stride_px`` x ``stride_px`` pixels of the input."""
        return self.tower(self.prepare(rgb))

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        """See ``Encoder``. Every text has an embedding; English ones are the most reliable."""
        return self._competition.queries(
            texts,
            self._texts(texts),
            encoder_id=self.encoder_id,
            text_space=self.text_space,
            floor=self._params.floor,
        )

    def embed_image(self, rgb: U8) -> TextEmbeddings:
        """See ``Encoder``: the mean of the patches that show the crop."""
        image, mask = framed(rgb, CAMERA_PX)
        features = self.encode(image)
        vector = mean_feature(features, patch_shares(mask, *features.shape[:2]))
        return uncalibrated_queries(
            (IMAGE_NAME,),
            vector[None],
            encoder_id=self.encoder_id,
            text_space=self.text_space,
            floor=0.0,
        )
