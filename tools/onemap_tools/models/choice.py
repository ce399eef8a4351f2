"""Which encoder and which detectors the user named, and the ``perception`` section for them."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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
# Settings of an encoder that stay when another network takes its place; all others were chosen
# for the former one: its floor, image size.
LASTING_ENCODER_KEYS = ("channels",)
SHORT = {"mini": "encoder", "patches": "detector"}  # sections that stand for a backend

Section = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class ModelChoice:
    """Backends with the hub id of each. encoder: empty to keep the one of the file.

    detectors: none to keep the file's; both of DETECTOR_NETWORKS make a routed one.
    """

    encoder: str = ""
    encoder_model: str = ""
    detectors: Mapping[str, str] | None = None


def choose(names: Sequence[str]) -> ModelChoice:
    """The models of the names: at most one encoder and one detector; CliError otherwise.

    A name is a backend or the hub id of a known model.
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
    encoder, model = next(iter(encoders.items()), ("", ""))
    return ModelChoice(encoder, model, detectors or None)


def _models_of(name: str) -> dict[str, str]:
    """Hub ids by backend."""
    if name in NAMES:
        return {
            each: _default_model(each)
            for each in (DETECTOR_NETWORKS if name == ROUTED else (name,))
        }
    known = {model.repo: model.backend for model in KNOWN_MODELS}
    if name in known:
        return {known[name]: name}
    valid = (*NAMES, *known)
    near = difflib.get_close_matches(name.lower(), [each.lower() for each in valid], 1, 0.5)
    meant = next((each for each in valid if near and each.lower() == near[0]), "")
    hint = f"did you mean {meant!r}?" if meant else f"there are {', '.join(NAMES)}"
    raise CliError(f"There is no model {name!r}; {hint}", EXIT_USAGE_ERROR)


def _default_model(backend: str) -> str:
    backend = "open_vocabulary" if backend == ROUTED else backend
    return next((model.repo for model in KNOWN_MODELS if model.backend == backend), "")


def perception_section(before: Section, choice: ModelChoice, device: str) -> dict[str, Any]:
    """The section ``perception`` with the chosen models on ``device``; all else as it was.

    An encoder without calibrated scores cannot have the detector ``patches``: it gets a routed
    one, unless another is chosen or was there.
    """
    after = spelled_out(before)
    detectors = choice.detectors
    if choice.encoder:
        chosen: dict[str, Any] = {"backend": choice.encoder, "model": choice.encoder_model}
        chosen["device"] = device
        fields = ENCODER_NETWORKS[choice.encoder].model_fields
        lasting = [key for key in LASTING_ENCODER_KEYS if key in fields]
        after["encoder"] = merged(after.get("encoder") or {}, chosen, lasting)
        detector = after.get("detector") or {}
        if detectors is None and detector.get("backend", "patches") == "patches":
            detectors = _models_of(ROUTED)
    if detectors is not None:
        after["detector"] = _detector_section(after.get("detector") or {}, detectors, device)
    return after


def spelled_out(section: Section) -> dict[str, Any]:
    """The section with ``mini: {...}`` and ``patches: {...}`` as the backends they stand for."""
    full = dict(section)
    for short, name in SHORT.items():
        if isinstance(full.get(short), dict) and name not in full:
            full[name] = {"backend": short, **full.pop(short)}
    return full


def _detector_section(before: Section, models: Mapping[str, str], device: str) -> dict[str, Any]:
    backend = ROUTED if len(models) > 1 else next(iter(models))
    chosen = {"backend": backend, "model": models.get("open_vocabulary") or models["coco"]}
    defaults = {"model": _default_model(before.get("backend", "patches"))}
    return merged({**defaults, **before}, {**chosen, "device": device}, ())


def merged(before: Section, chosen: Section, lasting: Sequence[str]) -> dict[str, Any]:
    """``chosen`` with the settings of ``before`` that hold for it too.

    All of them if it is the same network, only the ``lasting`` ones if not.
    """
    same = all(before.get(key) == chosen.get(key) for key in ("backend", "model"))
    kept = {key: value for key, value in before.items() if same or key in lasting}
    return {**kept, **chosen} if same else {**chosen, **kept}


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
