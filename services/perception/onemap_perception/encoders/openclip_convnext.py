"""OpenCLIP's ConvNeXt towers, the paper's encoder among them.

Weights come from a folder as the hub lays it out, from a file, or from one of SED's
checkpoints (the same tower fine-tuned, the text side frozen); the architecture is
``open_clip_config.json`` beside them, or follows from the width of the tower.
"""
# Touches files: weights.

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch

from onemap_perception.encoders.checkpoint import fingerprint, load_weights, read_weights
from onemap_perception.encoders.torch_encoder import VisionLanguageModel
from onemap_perception.errors import OPEN_CLIP, BackendError, optional_import
from onemap_shared.geometry import F32

STRIDE = 32  # of every ConvNeXt
CONFIG_FILE = "open_clip_config.json"
STEM = "visual.trunk.stem.0.weight"
ARCHITECTURES = {128: "convnext_base_w_320", 192: "convnext_large_d_320"}  # SED's, by width
WEIGHT_FILES = ("open_clip_model.safetensors", "open_clip_pytorch_model.bin")
CLIP_MEAN: F32 = np.array([0.48145466, 0.4578275, 0.40821073], np.float32)
CLIP_STD: F32 = np.array([0.26862954, 0.26130258, 0.27577711], np.float32)


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


def load_openclip_convnext(path: Path, device: torch.device) -> VisionLanguageModel:
    """The model of a folder as the hub lays it out, or of a file; raises BackendError.

    The text side runs on ``device`` in single precision. The text space is a digest of the text
    tower: SED's is that of the model it was fine-tuned from.
    """
    model, tokenizer, config = read_model(path)
    preprocess = config.get("preprocess_cfg", {})
    weights = model.state_dict()
    text_weights = ((name, w) for name, w in weights.items() if not name.startswith("visual."))
    vision = DenseConvNext(model.visual)
    del model.visual
    model.to(device)

    def embed(prompts: Sequence[str]) -> F32:
        with torch.inference_mode():
            tokens = tokenizer(list(prompts)).to(device)
            rows: F32 = model.encode_text(tokens).float().cpu().numpy()
        return rows

    return VisionLanguageModel(
        encoder_id="openclip_convnext-" + fingerprint(weights.items()),
        text_space="openclip-" + fingerprint(text_weights),
        vision=vision,
        embed=embed,
        stride_px=STRIDE,
        mean=np.array(preprocess.get("mean", CLIP_MEAN), np.float32),
        std=np.array(preprocess.get("std", CLIP_STD), np.float32),
        temperature=float(model.logit_scale.exp()),
    )


def read_model(path: Path) -> tuple[Any, Any, dict[str, Any]]:
    """open_clip's model with the weights in it, its tokenizer, its configuration; BackendError."""
    with optional_import("open_clip", OPEN_CLIP, backend="openclip_convnext"):
        from open_clip.model import CLIP
        from open_clip.tokenizer import SimpleTokenizer
    file = weight_file(path)
    weights = read_weights(file)
    config = read_architecture(file, weights)
    vision, text = config.get("vision_cfg", {}), config.get("text_cfg", {})
    foreign_text = {"hf_model_name", "hf_tokenizer_name"} & text.keys()
    if "convnext" not in str(vision.get("timm_model_name")) or foreign_text:
        raise BackendError(
            f"openclip_convnext cannot run the architecture {vision.get('timm_model_name')}: "
            "it takes ConvNeXt towers with CLIP's own text tower and tokenizer"
        )
    # The checkpoint holds every weight: nothing must be downloaded to start from.
    vision = {**vision, "timm_model_pretrained": False}
    model = CLIP(
        embed_dim=config["embed_dim"],
        vision_cfg=vision,
        text_cfg=text,
        quick_gelu=config.get("quick_gelu", False),
    )
    load_weights(model, weights, file)
    tokenizer = SimpleTokenizer(
        context_length=text.get("context_length", 77), **text.get("tokenizer_kwargs", {})
    )
    return model.eval().requires_grad_(False), tokenizer, config


def read_architecture(file: Path, weights: Mapping[str, torch.Tensor]) -> dict[str, Any]:
    """The architecture: of ``CONFIG_FILE`` beside the weights, or by the width of the tower."""
    beside = file.with_name(CONFIG_FILE)
    if not beside.exists():
        stem = weights.get(STEM)
        name = ARCHITECTURES.get(len(stem)) if stem is not None else None
        if name is None:
            raise BackendError(f"{file} does not say its architecture: put {CONFIG_FILE} beside it")
        return named_architecture(name)
    return read_config(beside)


def read_config(file: Path) -> dict[str, Any]:
    """embed_dim, vision_cfg, text_cfg and more, of a JSON file as the hub has it; BackendError.

    Its preprocess_cfg, which stands beside the architecture, is one of the keys.
    """
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
        config: dict[str, Any] = document.get("model_cfg", document)
        needed = {name: config[name] for name in ("embed_dim", "vision_cfg", "text_cfg")}
        return {**config, **needed, "preprocess_cfg": document.get("preprocess_cfg", {})}
    except (OSError, ValueError, KeyError, AttributeError) as problem:
        raise BackendError(f"{file} describes no OpenCLIP model: {problem!r}") from problem


def named_architecture(name: str) -> dict[str, Any]:
    """open_clip's architecture of this name; raises BackendError."""
    import open_clip

    config: dict[str, Any] | None = open_clip.get_model_config(name)
    if config is None:
        raise BackendError(f"open_clip knows no architecture {name!r}")
    return config


def weight_file(path: Path) -> Path:
    """The file itself, or the one in a folder as the hub lays it out."""
    if not path.is_dir():
        return path
    for name in WEIGHT_FILES:
        if (path / name).is_file():
            return path / name
    raise BackendError(f"{path} holds none of {', '.join(WEIGHT_FILES)}")
