"""Tiny random checkpoints in the layouts of the real ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import torch

EMBED_DIM = 16
OPEN_CLIP_CONFIG: dict[str, Any] = {
    "embed_dim": EMBED_DIM,
    "vision_cfg": {
        "timm_model_name": "test_convnext",
        "timm_model_pretrained": False,
        "timm_pool": "",
        "timm_proj": "mlp",
        "image_size": 64,
    },
    # The tokenizer's vocabulary; all else as small as it gets.
    "text_cfg": {
        "context_length": 77,
        "vocab_size": 49408,
        "width": 8,
        "heads": 1,
        "layers": 1,
    },
}
SED_PREFIX = "sem_seg_head.predictor.clip_model."
LAYOUTS = ("bare", "model", "sed")


def open_clip_model(seed: int = 0) -> Any:
    """open_clip's own model of the tiny architecture."""
    open_clip_model_module = pytest.importorskip("open_clip.model", reason="needs open_clip_torch")
    torch.manual_seed(seed)
    config = OPEN_CLIP_CONFIG
    return open_clip_model_module.CLIP(
        embed_dim=EMBED_DIM, vision_cfg=config["vision_cfg"], text_cfg=config["text_cfg"]
    ).eval()


def open_clip_folder(folder: Path, seed: int = 0) -> Path:
    """A folder as the hub lays it out."""
    from safetensors.torch import save_file

    folder.mkdir(parents=True, exist_ok=True)
    write_config(folder)
    weights = {
        name: value.contiguous() for name, value in open_clip_model(seed).state_dict().items()
    }
    save_file(weights, folder / "open_clip_model.safetensors")
    return folder


def open_clip_file(folder: Path, layout: str, *, without: str = "") -> Path:
    """A torch checkpoint in one of the LAYOUTS, its configuration beside it."""
    write_config(folder)
    weights = open_clip_model().state_dict()
    kept = {name: value for name, value in weights.items() if name != without}
    document: dict[str, Any]
    match layout:
        case "bare":
            document = kept
        case "model":
            document = {"model": kept, "iteration": 7}
        case _:
            decoder = {"sem_seg_head.predictor.transformer.decoder.weight": torch.zeros(3)}
            document = {"model": {SED_PREFIX + name: value for name, value in kept.items()}}
            document["model"].update(decoder)
    path = folder / f"{layout}.pth"
    torch.save(document, path)
    return path


def write_config(folder: Path) -> None:
    document = {"model_cfg": OPEN_CLIP_CONFIG, "preprocess_cfg": {}}
    (folder / "open_clip_config.json").write_text(json.dumps(document), encoding="utf-8")
