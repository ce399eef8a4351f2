"""Encoders of a vision tower and a text tower in torch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from onemap_perception.encoders.crops import framed, mean_feature, patch_shares
from onemap_perception.encoders.image import fitted_size, pixel_values, resized
from onemap_perception.encoders.params import TorchParams
from onemap_perception.encoders.torch_tower import open_tower
from onemap_perception.text.queries import IMAGE_NAME
from onemap_perception.text.scores import uncalibrated_queries
from onemap_perception.text.text_encoder import CachedTextEncoder, EmbedTexts
from onemap_shared.geometry import F16, F32, U8
from onemap_shared.messages import TextEmbeddings

NO_MEAN: F32 = np.zeros(3, np.float32)
NO_STD: F32 = np.ones(3, np.float32)


@dataclass(frozen=True, slots=True)
class VisionLanguageModel:
    """A loaded checkpoint.

    vision: images (1, 3, H, W) to features (1, H / stride_px, W / stride_px, D), not normalised;
    embed: prompts to rows (N, D), not normalised. mean, std (3,): of the channels in [0, 1].
    fixed_size_px: (width, height) of the input if it is not fitted to the image's shape.
    """

    encoder_id: str
    text_space: str
    vision: torch.nn.Module
    embed: EmbedTexts
    stride_px: int
    mean: F32
    std: F32
    fixed_size_px: tuple[int, int] | None = None


class TorchEncoder:
    """Implements ``Encoder`` for a loaded model; encodes one image at once to warm up."""

    def __init__(self, model: VisionLanguageModel, params: TorchParams) -> None:
        self.encoder_id = model.encoder_id
        self.text_space = model.text_space
        self.tower = open_tower(model.vision, params, model.encoder_id)
        self._stride_px, self._fixed_size_px = model.stride_px, model.fixed_size_px
        self._mean, self._std = model.mean, model.std
        self._params = params
        self._texts = CachedTextEncoder(
            model.embed, prompt=params.prompt, capacity=params.text_cache_size
        )
        width, height = params.warm_up_px
        self.encode(np.zeros((height, width, 3), np.uint8))

    def prepare(self, rgb: U8) -> F32:
        """The tower's input (1, 3, H, W) float32 for an image."""
        size = self._fixed_size_px or fitted_size(
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
        return uncalibrated_queries(
            texts,
            self._texts(texts),
            encoder_id=self.encoder_id,
            text_space=self.text_space,
            floor=self._params.floor,
        )

    def embed_image(self, rgb: U8) -> TextEmbeddings:
        """See ``ImageEncoder``: the mean of the patches that show the crop."""
        image, mask = framed(rgb, self._params.warm_up_px)
        features = self.encode(image)
        vector = mean_feature(features, patch_shares(mask, *features.shape[:2]))
        return uncalibrated_queries(
            (IMAGE_NAME,),
            vector[None],
            encoder_id=self.encoder_id,
            text_space=self.text_space,
            floor=0.0,
        )
