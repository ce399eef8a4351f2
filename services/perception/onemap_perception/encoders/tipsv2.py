"""TIPSv2 through transformers: patch features that training already aligned with text.

The last block takes its values in place of its attention (``o_proj(v_proj(x))``), which keeps
each patch's own content; the leading tokens (class and registers) are dropped. Images go in
as [0, 1], without mean and deviation.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch

from onemap_perception.encoders.checkpoint import fingerprint, load_pretrained
from onemap_perception.encoders.torch_encoder import NO_MEAN, NO_STD, VisionLanguageModel
from onemap_perception.errors import TRANSFORMERS, BackendError, first_line, optional_import
from onemap_shared.geometry import F32

MAX_TOKENS = 64  # what the text side was trained with; shorter texts are padded to it
LIBRARY = "transformers 5.23 or later"


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


def block_of_values(block: Any, tokens: torch.Tensor) -> torch.Tensor:
    """The block on tokens (B, T, D) as if each token attended to itself alone."""
    values = block.attention.o_proj(block.attention.v_proj(block.norm1(tokens)))
    tokens = tokens + block.layer_scale1(values)
    result: torch.Tensor = tokens + block.layer_scale2(block.mlp(block.norm2(tokens)))
    return result


def load_tipsv2(path: Path, device: torch.device) -> VisionLanguageModel:
    """The model of a folder as the hub lays it out; raises BackendError.

    The text side runs on ``device`` in single precision; the text space is a digest of it.
    """
    model, tokenizer = read_model(path)
    encoder_id = "tipsv2-" + fingerprint(model.state_dict().items())
    text_model = model.text_model
    text_space = "tipsv2-" + fingerprint(text_model.state_dict().items())
    text_model.to(device)
    vision = DenseTips(model.vision_model)

    def embed(prompts: Sequence[str]) -> F32:
        tokens = tokenizer(
            list(prompts),
            padding="max_length",
            truncation=True,
            max_length=MAX_TOKENS,
            return_tensors="pt",
        ).to(device)
        with torch.inference_mode():
            pooled = text_model(
                input_ids=tokens["input_ids"], attention_mask=tokens["attention_mask"]
            ).pooler_output
            rows: F32 = pooled.float().cpu().numpy()
        return rows

    return VisionLanguageModel(
        encoder_id=encoder_id,
        text_space=text_space,
        vision=vision,
        embed=embed,
        stride_px=vision.patch_px,
        mean=NO_MEAN,
        std=NO_STD,
        temperature=1.0 / float(model.temperature),
    )


def read_model(folder: Path) -> tuple[Any, Any]:
    """Model and tokenizer from files of this machine; BackendError if either fails."""
    with optional_import(LIBRARY, TRANSFORMERS, backend="tipsv2"):
        from transformers import AutoTokenizer, Tipsv2Model
    model = load_pretrained(Tipsv2Model, folder, what="TIPSv2 model", use_safetensors=True)
    try:
        return model, AutoTokenizer.from_pretrained(folder, local_files_only=True)
    except Exception as problem:  # of transformers, tokenizers and the disk
        raise BackendError(f"{folder} holds no TIPSv2 model: {first_line(problem)}") from problem
