"""OpenCLIP's ConvNeXt towers, the paper's encoder among them.

Weights come from a folder as the hub lays it out, from a file, or from one of SED's
checkpoints (the same tower fine-tuned, the text side frozen); the architecture is
``open_clip_config.json`` beside them or one that open_clip knows by name.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch

from onemap_perception.encoders.checkpoint import fingerprint, load_weights, read_weights
from onemap_perception.encoders.image import fitted_size, pixel_values, resized
from onemap_perception.encoders.protocol import EncoderError
from onemap_perception.encoders.torch_tower import (
    Tower,
    TowerParams,
    open_tower,
)
from onemap_perception.optional_import import OPEN_CLIP, optional_import
from onemap_perception.text.scores import uncalibrated_queries
from onemap_perception.text.text_encoder import CachedTextEncoder
from onemap_perception.torch_device import open_device
from onemap_shared.geometry import F16, F32, U8
from onemap_shared.messages import TextEmbeddings

STRIDE = 32  # of every ConvNeXt
SED_SIDE_PX = 768
CONFIG_FILE = "open_clip_config.json"
WEIGHT_FILES = ("open_clip_model.safetensors", "open_clip_pytorch_model.bin")
CLIP_MEAN: F32 = np.array([0.48145466, 0.4578275, 0.40821073], np.float32)
CLIP_STD: F32 = np.array([0.26862954, 0.26130258, 0.27577711], np.float32)


@dataclass(frozen=True, slots=True)
class OpenClipSettings:
    """weights: a file, or a folder as the hub lays it out. architecture: open_clip's name or a
    JSON file; empty takes the folder's own. sed_compat: the paper's 768 x 768, shape not kept.
    prompt: ``{}`` in it is the text; kept_texts: embeddings remembered;
    floor: a best score below it means "not here", 0: not measured."""

    weights: Path
    architecture: str = ""
    long_side_px: int = 640
    sed_compat: bool = False
    prompt: str = "a {}"
    kept_texts: int = 1024
    floor: float = 0.0
    tower: TowerParams = field(default_factory=TowerParams)


class DenseConvNext(torch.nn.Module):
    """Trunk, then per location the head that the pooled feature goes through."""

    def __init__(self, visual: Any) -> None:
        super().__init__()
        self.trunk, self.head = visual.trunk, visual.head

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        """Features (B, H / 32, W / 32, D), not normalised, of images (B, 3, H, W)."""
        locations = self.trunk.forward_features(image).permute(0, 2, 3, 1)
        norm = self.trunk.head.norm
        whitened = torch.nn.functional.layer_norm(
            locations, (locations.shape[-1],), norm.weight, norm.bias, norm.eps
        )
        projected: torch.Tensor = self.head(whitened)
        return projected


class OpenClipConvNext:
    """Implements ``Encoder``. Raises EncoderError when it cannot be loaded."""

    def __init__(self, settings: OpenClipSettings) -> None:
        device = open_device(settings.tower.device)
        model, tokenizer = load_model(settings)
        names = model.state_dict().items()
        self._text_space = "openclip-" + fingerprint(
            (name, value) for name, value in names if not name.startswith("visual.")
        )
        self._id = "openclip_convnext-" + fingerprint(names)
        self._settings = settings
        self._text_device = device
        self._tower = open_tower(DenseConvNext(model.visual), settings.tower, self._id)
        del model.visual  # the text side stays in single precision
        self._model, self._tokenizer = model.to(device), tokenizer
        self._floor = settings.floor
        self._texts = CachedTextEncoder(
            self._embed, prompt=settings.prompt, capacity=settings.kept_texts
        )
        width, height = settings.tower.warm_up_px
        self.encode(np.zeros((height, width, 3), np.uint8))

    @property
    def encoder_id(self) -> str:
        """``openclip_convnext-`` and a digest of all weights, images' and texts'."""
        return self._id

    @property
    def text_space(self) -> str:
        """``openclip-`` and a digest of the text tower: SED's is the one it was made from."""
        return self._text_space

    @property
    def tower(self) -> Tower:
        """The image's side, for export and measurement."""
        return self._tower

    def prepare(self, rgb: U8) -> F32:
        """The image (1, 3, H, W) float32 that is fed in."""
        return pixel_values(resized(rgb, self._input_size(rgb)), CLIP_MEAN, CLIP_STD)

    def encode(self, rgb: U8) -> F16:
        """See ``Encoder``; one patch per 32 x 32 pixels of what is fed in."""
        return self._tower(self.prepare(rgb))

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        """See ``Encoder``. Any text has an embedding, the better the more English it is."""
        rows = self._texts(texts)
        return uncalibrated_queries(
            texts, rows, encoder_id=self._id, text_space=self._text_space, floor=self._floor
        )

    def _input_size(self, rgb: U8) -> tuple[int, int]:
        if self._settings.sed_compat:
            return SED_SIDE_PX, SED_SIDE_PX
        long_side_px = self._settings.long_side_px
        return fitted_size(rgb.shape[1], rgb.shape[0], long_side_px=long_side_px, stride=STRIDE)

    def _embed(self, prompts: Sequence[str]) -> F32:
        with torch.inference_mode():
            tokens = self._tokenizer(list(prompts)).to(self._text_device)
            rows: F32 = self._model.encode_text(tokens).float().cpu().numpy()
        return rows


def load_model(settings: OpenClipSettings) -> tuple[Any, Any]:
    """open_clip's model with the weights in it, and its tokenizer; EncoderError if either fails."""
    with optional_import("open_clip", OPEN_CLIP, backend="openclip_convnext", kind=EncoderError):
        from open_clip.model import CLIP
        from open_clip.tokenizer import SimpleTokenizer
    path = weight_file(settings.weights)
    config = architecture(settings)
    vision, text = config.get("vision_cfg", {}), config.get("text_cfg", {})
    if "convnext" not in str(vision.get("timm_model_name")) or "hf_model_name" in text:
        raise EncoderError(
            f"openclip_convnext cannot run the architecture {vision.get('timm_model_name')}: "
            "it takes ConvNeXt towers with CLIP's own text tower"
        )
    # The checkpoint brings every weight: nothing is to be fetched for a start.
    vision = {**vision, "timm_model_pretrained": False}
    model = CLIP(embed_dim=config["embed_dim"], vision_cfg=vision, text_cfg=text)
    load_weights(model, read_weights(path), path)
    tokenizer = SimpleTokenizer(context_length=text.get("context_length", 77))
    return model.eval().requires_grad_(False), tokenizer


def architecture(settings: OpenClipSettings) -> dict[str, Any]:
    """embed_dim, vision_cfg and text_cfg."""
    named = settings.architecture
    if named and not named.endswith(".json"):
        import open_clip

        known: dict[str, Any] | None = open_clip.get_model_config(named)
        if known is None:
            raise EncoderError(f"open_clip knows no architecture {named!r}")
        return known
    folder = settings.weights if settings.weights.is_dir() else settings.weights.parent
    path = Path(named) if named else folder / CONFIG_FILE
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        config: dict[str, Any] = document.get("model_cfg", document)
        return {name: config[name] for name in ("embed_dim", "vision_cfg", "text_cfg")}
    except OSError as problem:
        raise EncoderError(
            f"{path} cannot be read ({problem.strerror}): "
            "name the architecture, for example convnext_large_d_320"
        ) from problem
    except (ValueError, KeyError, AttributeError) as problem:
        raise EncoderError(f"{path} describes no OpenCLIP model: {problem!r}") from problem


def weight_file(place: Path) -> Path:
    """The file itself, or the one in a folder as the hub lays it out."""
    if not place.is_dir():
        return place
    for name in WEIGHT_FILES:
        if (place / name).is_file():
            return place / name
    raise EncoderError(f"{place} holds none of {', '.join(WEIGHT_FILES)}")
