"""TIPSv2 through transformers: patches that training already aligned with text.

The last block takes its values in place of its attention (``o_proj(v_proj(x))``), which keeps
each patch's own content; the leading tokens (class and registers) are dropped. Images go in
as [0, 1], without mean and deviation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch

from onemap_perception.encoders.checkpoint import fingerprint
from onemap_perception.encoders.image import fitted_size, pixel_values, resized
from onemap_perception.encoders.protocol import EncoderError
from onemap_perception.encoders.torch_tower import (
    Tower,
    TowerParams,
    open_tower,
)
from onemap_perception.optional_import import TRANSFORMERS, optional_import
from onemap_perception.text.scores import uncalibrated_queries
from onemap_perception.text.text_encoder import CachedTextEncoder
from onemap_perception.torch_device import open_device
from onemap_shared.geometry import F16, F32, U8
from onemap_shared.messages import TextEmbeddings

MAX_TOKENS = 64  # what the text side was trained with; shorter texts are padded to it
NO_MEAN: F32 = np.zeros(3, np.float32)
NO_STD: F32 = np.ones(3, np.float32)
LIBRARY = "transformers 5.23 or later"


@dataclass(frozen=True, slots=True)
class Tipsv2Settings:
    """folder: as the hub lays it out; the others as in ``OpenClipSettings``."""

    folder: Path
    long_side_px: int = 448
    prompt: str = "a {}"
    kept_texts: int = 1024
    floor: float = 0.0
    tower: TowerParams = field(default_factory=TowerParams)


class DenseTips(torch.nn.Module):
    """The vision tower with the values trick in its last block."""

    def __init__(self, vision: Any) -> None:
        super().__init__()
        self.vision = vision
        self.patch_px = int(vision.config.patch_size)
        self.leading = 1 + int(vision.config.num_register_tokens)

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        """Features (B, H / p, W / p, D), not normalised, of images (B, 3, H, W)."""
        tokens = self.vision.embeddings(image)
        *blocks, last = self.vision.encoder.layer
        for block in blocks:
            tokens = block(tokens)
        patches = self.vision.layernorm(block_of_values(last, tokens))[:, self.leading :]
        rows, columns = (side // self.patch_px for side in image.shape[2:])
        dense: torch.Tensor = patches.reshape(len(image), rows, columns, -1)
        return dense

    def fix_size(self, width: int, height: int) -> None:
        """From now on for images of this size only: their positions become a constant.

        ONNX knows no antialiased interpolation, which is how positions fit another size.
        """
        embeddings = self.vision.embeddings
        cells = (width // self.patch_px) * (height // self.patch_px)
        size_of = embeddings.position_embeddings.new_zeros(
            1, 1 + cells, self.vision.config.hidden_size
        )
        fixed = embeddings.interpolate_pos_encoding(size_of, height, width).detach()
        embeddings.interpolate_pos_encoding = lambda *_: fixed


def block_of_values(block: Any, tokens: torch.Tensor) -> torch.Tensor:
    """The block on tokens (B, T, D) as if each token attended to itself alone."""
    values = block.attention.o_proj(block.attention.v_proj(block.norm1(tokens)))
    tokens = tokens + block.layer_scale1(values)
    result: torch.Tensor = tokens + block.layer_scale2(block.mlp(block.norm2(tokens)))
    return result


class Tipsv2Encoder:
    """Implements ``Encoder``. Raises EncoderError when it cannot be loaded."""

    def __init__(self, settings: Tipsv2Settings) -> None:
        self._device = open_device(settings.tower.device)
        model, self._tokenizer = load_model(settings.folder)
        self._text_space = "tipsv2-" + fingerprint(model.text_model.state_dict().items())
        self._id = "tipsv2-" + fingerprint(model.state_dict().items())
        dense = DenseTips(model.vision_model)
        self._stride = dense.patch_px
        self._long_side_px = settings.long_side_px
        self._tower = open_tower(dense, settings.tower, self._id)
        self._text = model.text_model.to(self._device)
        self._floor = settings.floor
        self._texts = CachedTextEncoder(
            self._embed, prompt=settings.prompt, capacity=settings.kept_texts
        )
        width, height = settings.tower.warm_up_px
        self.encode(np.zeros((height, width, 3), np.uint8))

    @property
    def encoder_id(self) -> str:
        """``tipsv2-`` and a digest of all weights."""
        return self._id

    @property
    def text_space(self) -> str:
        """``tipsv2-`` and a digest of the text tower."""
        return self._text_space

    @property
    def tower(self) -> Tower:
        """The image's side, for export and measurement."""
        return self._tower

    def prepare(self, rgb: U8) -> F32:
        """The image (1, 3, H, W) float32 in [0, 1] that is fed in."""
        size = fitted_size(
            rgb.shape[1], rgb.shape[0], long_side_px=self._long_side_px, stride=self._stride
        )
        return pixel_values(resized(rgb, size), NO_MEAN, NO_STD)

    def encode(self, rgb: U8) -> F16:
        """See ``Encoder``; one patch per 14 x 14 pixels of what is fed in."""
        return self._tower(self.prepare(rgb))

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        """See ``Encoder``. Any text has an embedding, the better the more English it is."""
        rows = self._texts(texts)
        return uncalibrated_queries(
            texts, rows, encoder_id=self._id, text_space=self._text_space, floor=self._floor
        )

    def _embed(self, prompts: Sequence[str]) -> F32:
        tokens = self._tokenizer(
            list(prompts),
            padding="max_length",
            truncation=True,
            max_length=MAX_TOKENS,
            return_tensors="pt",
        ).to(self._device)
        with torch.inference_mode():
            pooled = self._text(
                input_ids=tokens["input_ids"], attention_mask=tokens["attention_mask"]
            ).pooler_output
            rows: F32 = pooled.float().cpu().numpy()
        return rows


def load_model(folder: Path) -> tuple[Any, Any]:
    """Model and tokenizer from files of this machine; EncoderError if either fails."""
    with optional_import(LIBRARY, TRANSFORMERS, backend="tipsv2", kind=EncoderError):
        from transformers import AutoTokenizer, Tipsv2Model
    try:
        model, report = Tipsv2Model.from_pretrained(
            folder, local_files_only=True, use_safetensors=True, output_loading_info=True
        )
        tokenizer = AutoTokenizer.from_pretrained(folder, local_files_only=True)
    except Exception as problem:  # of transformers, tokenizers, safetensors and the disk
        reason = str(problem).strip().splitlines()[0]
        raise EncoderError(f"{folder} holds no TIPSv2 model: {reason}") from problem
    missing_keys = sorted(report["missing_keys"])
    if missing_keys:
        raise EncoderError(f"{folder} is of another architecture: it lacks {missing_keys[0]}")
    return model.float().eval().requires_grad_(False), tokenizer
