"""Loads weights from checkpoints into models, or raises an error with the reason.

Only tensors are read: safetensors, or torch files with ``weights_only``, which refuses
anything that would run code while loading.
"""
# Touches files: weights.

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import torch

from onemap_perception.errors import BackendError, OutOfDeviceMemoryError, first_line

SED_PREFIX = "sem_seg_head.predictor.clip_model."
UNUSED = "logit_scale"  # of the training loss; some files do not have it
MAX_NAMED = 3  # missing tensors that an error lists before it counts the rest


def read_weights(path: Path) -> dict[str, torch.Tensor]:
    """Tensors by name, of a bare file, one inside ``{"model": ...}``, or one of SED's."""
    if not path.is_file():
        raise BackendError(f"the checkpoint {path} does not exist")
    try:
        document = _read(path)
    except Exception as problem:  # torch, zipfile and safetensors share no other base class
        raise BackendError(
            f"{path} is not a checkpoint of tensors alone: {first_line(problem)}"
        ) from problem
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
    """Copy ``weights`` into ``model``; raises BackendError unless every tensor is there and fits.

    Tensors that the model does not have (SED's decoder) are ignored.
    """
    parameters = model.state_dict()
    missing = [name for name in parameters if name not in weights and name != UNUSED]
    if missing:
        raise BackendError(f"{path} is of another architecture: it lacks {_listed(missing)}")
    used = {name: weights[name] for name in parameters if name in weights}
    for name, value in used.items():
        if value.shape != parameters[name].shape:
            raise BackendError(
                f"{path} is of another architecture: {name} has shape "
                f"{tuple(value.shape)}; expected {tuple(parameters[name].shape)}"
            )
    model.load_state_dict(used, strict=False)


def load_pretrained(kind: Any, folder: Path, *, what: str, **options: Any) -> Any:
    """transformers' model of this class, for inference, if every tensor is there; BackendError."""
    try:
        model, report = kind.from_pretrained(
            folder, local_files_only=True, output_loading_info=True, **options
        )
    except Exception as problem:  # of transformers, safetensors, the disk and the model's own code
        raise BackendError(f"{folder} holds no {what}: {first_line(problem)}") from problem
    missing = sorted(report["missing_keys"])
    if missing:
        raise BackendError(f"{folder} is of another architecture: it lacks {missing[0]}")
    return model.float().eval().requires_grad_(False)


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
        raise BackendError(f"{path} holds {type(document).__name__}, not tensors by name")
    return document.items()


def _listed(names: list[str]) -> str:
    shown = ", ".join(names[:MAX_NAMED])
    more = len(names) - MAX_NAMED
    return f"{shown} and {more} more" if more > 0 else shown


def open_device(name: str) -> torch.device:
    """The device; raises BackendError if this machine or this torch has none of the name."""
    try:
        device = torch.device(name)
        torch.empty(1, device=device)
    except (RuntimeError, AssertionError) as problem:
        raise BackendError(f"device {name!r} cannot be used: {first_line(problem)}") from problem
    return device


@contextmanager
def inference(device: torch.device, image_px: tuple[int, int]) -> Iterator[None]:
    """Inference on an image of (width, height); errors of torch become BackendError.

    If the device is full its cached blocks are freed, so that the next image may fit.
    """
    width, height = image_px
    try:
        with torch.inference_mode():
            yield
    except torch.OutOfMemoryError as problem:
        if device.type == "cuda":
            torch.cuda.empty_cache()
        raise OutOfDeviceMemoryError(
            f"{device} is out of memory for an image of {width} x {height}: "
            "feed smaller images or free the device"
        ) from problem
    except (RuntimeError, ValueError, IndexError) as problem:  # of torch and transformers
        raise BackendError(f"the network failed on {device}: {first_line(problem)}") from problem
