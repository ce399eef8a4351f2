"""C-RADIO with its SigLIP2 adaptor: code of the model's own repository runs in this process.

That is why it is behind a flag: without ``allow_remote_code`` nothing of it is even read. The
repository's own interface is used as its documentation states it.
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
from onemap_perception.encoders.tipsv2 import NO_MEAN, NO_STD
from onemap_perception.encoders.torch_tower import TowerParams, open_tower
from onemap_perception.optional_import import TRANSFORMERS, optional_import
from onemap_perception.text.scores import uncalibrated_queries
from onemap_perception.text.text_encoder import CachedTextEncoder
from onemap_perception.torch_device import open_device
from onemap_shared.geometry import F16, F32, U8
from onemap_shared.messages import TextEmbeddings

STRIDE = 16
ADAPTOR = "siglip2-g"  # its name in the repository: features in the space of SigLIP2's texts


@dataclass(frozen=True, slots=True)
class RadioSettings:
    """folder: as the hub lays it out, its Python files too; the others as in
    ``OpenClipSettings``."""

    folder: Path
    allow_remote_code: bool = False
    long_side_px: int = 640
    prompt: str = "a {}"
    kept_texts: int = 1024
    floor: float = 0.0
    tower: TowerParams = field(default_factory=TowerParams)


class DenseRadio(torch.nn.Module):
    """The adaptor's features, laid out as the image."""

    def __init__(self, model: torch.nn.Module) -> None:
        super().__init__()
        self.model = model

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        """Features (B, H / 16, W / 16, D), not normalised, of images (B, 3, H, W) in [0, 1]."""
        _, features = self.model(image)[ADAPTOR]
        rows, columns = (side // STRIDE for side in image.shape[2:])
        dense: torch.Tensor = features.reshape(len(image), rows, columns, -1)
        return dense


class RadioEncoder:
    """Implements ``Encoder``. Raises EncoderError when it cannot be loaded."""

    def __init__(self, settings: RadioSettings) -> None:
        self._device = open_device(settings.tower.device)
        model = load_model(settings)
        adaptor: Any = model.radio_model.adaptors[ADAPTOR]
        self._id = "radio-" + fingerprint(model.state_dict().items())
        self._long_side_px = settings.long_side_px
        self._tower = open_tower(DenseRadio(model), settings.tower, self._id)
        self._adaptor = adaptor.to(self._device)
        self._floor = settings.floor
        self._texts = CachedTextEncoder(
            self._embed, prompt=settings.prompt, capacity=settings.kept_texts
        )
        width, height = settings.tower.warm_up_px
        self.encode(np.zeros((height, width, 3), np.uint8))

    @property
    def encoder_id(self) -> str:
        """``radio-`` and a digest of all weights."""
        return self._id

    @property
    def text_space(self) -> str:
        """The adaptor's."""
        return ADAPTOR

    def encode(self, rgb: U8) -> F16:
        """See ``Encoder``; one patch per 16 x 16 pixels of what is fed in."""
        size = fitted_size(
            rgb.shape[1], rgb.shape[0], long_side_px=self._long_side_px, stride=STRIDE
        )
        return self._tower(pixel_values(resized(rgb, size), NO_MEAN, NO_STD))

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        """See ``Encoder``."""
        rows = self._texts(texts)
        return uncalibrated_queries(
            texts, rows, encoder_id=self._id, text_space=ADAPTOR, floor=self._floor
        )

    def _embed(self, prompts: Sequence[str]) -> F32:
        with torch.inference_mode():
            tokens = self._adaptor.tokenizer(list(prompts)).to(self._device)
            rows: F32 = self._adaptor.encode_text(tokens).float().cpu().numpy()
        return rows


def load_model(settings: RadioSettings) -> Any:
    """The repository's model from files of this machine; EncoderError if not allowed or broken."""
    if not settings.allow_remote_code:
        raise EncoderError(
            "radio runs code that comes with its weights: read it, then set "
            "perception.encoder.allow_remote_code: true"
        )
    with optional_import("transformers", TRANSFORMERS, backend="radio", kind=EncoderError):
        from transformers import AutoModel
    try:
        return (
            AutoModel.from_pretrained(
                settings.folder,
                local_files_only=True,
                trust_remote_code=True,
                adaptor_names=[ADAPTOR],
            )
            .float()
            .eval()
        )
    except Exception as problem:  # of somebody else's code
        reason = (str(problem).strip() or repr(problem)).splitlines()[0]
        raise EncoderError(f"{settings.folder} holds no RADIO model: {reason}") from problem
