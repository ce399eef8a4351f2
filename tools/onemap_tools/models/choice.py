"""Which encoder and which detectors the user named, and the ``perception`` section for them."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from onemap_perception.config import (
    DETECTOR_NETWORKS,
    ENCODER_NETWORKS,
    KNOWN_MODELS,
    NetworkParams,
    PerceptionConfig,
    RoutedParams,
)
from onemap_perception.errors import optional_import
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

ROUTED = "routed"  # COCO's names to one detector, all others to the other
NAMES = (*ENCODER_NETWORKS, *DETECTOR_NETWORKS, ROUTED)


def perception_section(names: Sequence[str], device: str) -> dict[str, Any]:
    """The models of the names on a device: at most one encoder and one detector, else CliError.

    A name is a backend or the hub id of a known model. An encoder without a detector gets a routed
    one: its scores are not calibrated, as those that the detector ``patches`` needs.
    """
    encoders: dict[str, str] = {}
    detectors: dict[str, str] = {}
    for name in names:
        for backend, repo in _models_of(name).items():
            (encoders if backend in ENCODER_NETWORKS else detectors)[backend] = repo
    if len(encoders) > 1:
        raise CliError(f"{' and '.join(encoders)} are both encoders: name one", EXIT_USAGE_ERROR)
    if len(detectors) > 1 and ROUTED not in names:
        raise CliError(
            f"{' and '.join(detectors)} are both detectors: name one, or {ROUTED} to run both",
            EXIT_USAGE_ERROR,
        )
    detectors = detectors or _models_of(ROUTED)
    backend = ROUTED if len(detectors) > 1 else next(iter(detectors))
    repo = detectors.get("open_vocabulary") or detectors["coco"]
    chosen = [*(("encoder", *each) for each in encoders.items()), ("detector", backend, repo)]
    return {
        part: {"backend": backend, "model": model, "device": device}
        for part, backend, model in chosen
    }


def _models_of(name: str) -> dict[str, str]:
    """Hub ids by backend."""
    if name == ROUTED:
        return {backend: _default_model(backend) for backend in DETECTOR_NETWORKS}
    if name in NAMES:
        return {name: _default_model(name)}
    known = {model.repo: model.backend for model in KNOWN_MODELS}
    if name in known:
        return {known[name]: name}
    valid = (*NAMES, *known)
    near = difflib.get_close_matches(name.lower(), [each.lower() for each in valid], 1, 0.5)
    meant = next((each for each in valid if near and each.lower() == near[0]), "")
    hint = f"did you mean {meant!r}?" if meant else f"there are {', '.join(NAMES)}"
    raise CliError(f"There is no model {name!r}; {hint}", EXIT_USAGE_ERROR)


def _default_model(backend: str) -> str:
    return next(model.repo for model in KNOWN_MODELS if model.backend == backend)


def networks_of(config: PerceptionConfig) -> tuple[NetworkParams, ...]:
    """The parameters of every network that a model is loaded for; none of ``mini``."""
    detector = config.detector
    parts: tuple[object, ...] = (config.encoder, detector)
    if isinstance(detector, RoutedParams):
        parts = (config.encoder, detector.coco, detector.open_vocabulary)
    return tuple(part for part in parts if isinstance(part, NetworkParams))


def check_packages(config: PerceptionConfig) -> None:
    """Import what the encoder and the detector need; BackendError with the command for it."""
    for params in networks_of(config):
        needed = params.package
        with optional_import(needed.name, needed.install, backend=params.backend):
            if not hasattr(import_module(needed.module), needed.attribute):
                raise ImportError(f"{needed.module} has no {needed.attribute}")
