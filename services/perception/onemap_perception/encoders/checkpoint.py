"""Loads weights from checkpoints into models, or raises an error with the reason.

Only tensors are read: safetensors, or torch files with ``weights_only``, which refuses
anything that would run code while loading.
"""
# Touches files: weights.

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import torch

from onemap_perception.encoders.protocol import EncoderError

SED_PREFIX = "sem_seg_head.predictor.clip_model."
UNUSED = "logit_scale"  # of the training loss; some files do not have it
MAX_NAMED = 3  # missing tensors that an error lists before it counts the rest


def read_weights(path: Path) -> dict[str, torch.Tensor]:
    """Tensors by name, of a bare file, one inside ``{"model": ...}``, or one of SED's."""
    if not path.is_file():
        raise EncoderError(f"the checkpoint {path} does not exist")
    try:
        document = _read(path)
    except Exception as problem:  # torch, zipfile and safetensors share no other base class
        reason = str(problem).strip().splitlines()[0] if str(problem).strip() else repr(problem)
        raise EncoderError(f"{path} is not a checkpoint of tensors alone: {reason}") from problem
    return unwrap(document, path)


def unwrap(document: Any, path: Path) -> dict[str, torch.Tensor]:
    """The model's tensors, out of the dictionaries that training scripts put around them."""
    for wrapper in ("model", "state_dict"):
        if isinstance(document, Mapping) and isinstance(document.get(wrapper), Mapping):
            document = document[wrapper]
    tensors = {
        name: value for name, value in _items(document, path) if isinstance(value, torch.Tensor)
    }
    sed_tensors = {
        name[len(SED_PREFIX) :]: value
        for name, value in tensors.items()
        if name.startswith(SED_PREFIX)
    }
    return sed_tensors or tensors


def load_weights(model: torch.nn.Module, weights: Mapping[str, torch.Tensor], path: Path) -> None:
    """Copy ``weights`` into ``model``; raises EncoderError unless every tensor is there and fits.

    Tensors that the model does not have (SED's decoder) are ignored.
    """
    parameters = model.state_dict()
    missing = [name for name in parameters if name not in weights and name != UNUSED]
    if missing:
        raise EncoderError(f"{path} is of another architecture: it lacks {_listed(missing)}")
    used = {name: weights[name] for name in parameters if name in weights}
    for name, value in used.items():
        if value.shape != parameters[name].shape:
            raise EncoderError(
                f"{path} is of another architecture: {name} has shape "
                f"{tuple(value.shape)}; expected {tuple(parameters[name].shape)}"
            )
    model.load_state_dict(used, strict=False)


def fingerprint(weights: Iterable[tuple[str, torch.Tensor]]) -> str:
    """Eight hexadecimal digits of the SHA-256 over names and values, in the order of names."""
    digest = hashlib.sha256()
    for name, value in sorted(weights, key=lambda item: item[0]):
        digest.update(name.encode())
        digest.update(value.detach().to("cpu", torch.float32).contiguous().numpy().data)
    return digest.hexdigest()[:8]


def _read(path: Path) -> Any:
    if path.suffix == ".safetensors":
        from safetensors.torch import load_file

        return load_file(path)
    return torch.load(path, map_location="cpu", weights_only=True)


def _items(document: Any, path: Path) -> Iterable[tuple[str, Any]]:
    if not isinstance(document, Mapping):
        raise EncoderError(f"{path} holds {type(document).__name__}, not tensors by name")
    return document.items()


def _listed(names: list[str]) -> str:
    shown = ", ".join(names[:MAX_NAMED])
    more = len(names) - MAX_NAMED
    return f"{shown} and {more} more" if more > 0 else shown
