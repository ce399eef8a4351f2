"""C-RADIO with its SigLIP2 adaptor: runs code of the model's own repository in this process.

Therefore nothing of it is read unless ``allow_remote_code`` is set. The repository's interface
is used as its documentation states it.
"""
# Touches files: which code a model's configuration names.

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch

from onemap_perception.config import RadioParams
from onemap_perception.encoders.checkpoint import fingerprint
from onemap_perception.encoders.torch_encoder import NO_MEAN, NO_STD, VisionLanguageModel
from onemap_perception.errors import TRANSFORMERS, BackendError, first_line, optional_import
from onemap_shared.geometry import F32

STRIDE = 16
ADAPTOR = "siglip2-g"  # its name in the repository: features in the space of SigLIP2's texts


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


def load_radio(params: RadioParams, path: Path, device: torch.device) -> VisionLanguageModel:
    """The model of a folder as the hub lays it out, its Python files too; raises BackendError.

    Refuses before anything is read unless ``allow_remote_code`` is set.
    """
    if not params.allow_remote_code:
        raise BackendError(
            "radio runs code that comes with its weights: read it, then set "
            "perception.encoder.allow_remote_code: true"
        )
    model = read_model(path)
    adaptor: Any = model.radio_model.adaptors[ADAPTOR].to(device)

    def embed(prompts: Sequence[str]) -> F32:
        with torch.inference_mode():
            tokens = adaptor.tokenizer(list(prompts)).to(device)
            rows: F32 = adaptor.encode_text(tokens).float().cpu().numpy()
        return rows

    return VisionLanguageModel(
        encoder_id="radio-" + fingerprint(model.state_dict().items()),
        text_space=ADAPTOR,
        vision=DenseRadio(model),
        embed=embed,
        stride_px=STRIDE,
        mean=NO_MEAN,
        std=NO_STD,
    )


def read_model(folder: Path) -> Any:
    """The repository's model from files of this machine; raises BackendError.

    Code of another repository, which its configuration may name, is refused: nobody was shown it.
    """
    _check_own_code(folder)
    with optional_import("transformers", TRANSFORMERS, backend="radio"):
        from transformers import AutoModel
    try:
        return (
            AutoModel.from_pretrained(
                folder,
                local_files_only=True,
                trust_remote_code=True,
                adaptor_names=[ADAPTOR],
            )
            .float()
            .eval()
        )
    except Exception as problem:  # of the model's own code
        raise BackendError(f"{folder} holds no RADIO model: {first_line(problem)}") from problem


def _check_own_code(folder: Path) -> None:
    try:
        named = json.loads((folder / "config.json").read_text(encoding="utf-8"))["auto_map"]
        classes = [str(each) for each in named.values()]
    except (OSError, ValueError, LookupError, AttributeError, TypeError) as problem:
        raise BackendError(f"{folder} holds no RADIO model: its config.json names no code") from (
            problem
        )
    foreign = [each for each in classes if "--" in each]  # repository--module.Class
    if foreign:
        raise BackendError(
            f"{folder} would run code of another repository, {foreign[0].partition('--')[0]}: "
            "nobody has shown it to you"
        )
