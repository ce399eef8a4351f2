"""Builds the configured encoder and detector; imports torch only for those that need it."""
# Touches files: entry points of installed packages.

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any

from onemap_perception.config import (
    SHIPPED,
    BoxParams,
    CocoParams,
    DetectorParams,
    EncoderParams,
    MiniParams,
    OpenClipConvNextParams,
    OpenVocabularyParams,
    PatchesParams,
    PluginParams,
    RadioParams,
    RoutedParams,
    Tipsv2Params,
    TorchParams,
)
from onemap_perception.detectors.boxes import BoxDetector, RoutedDetector
from onemap_perception.detectors.patches import PatchDetector
from onemap_perception.detectors.protocol import Detector
from onemap_perception.encoders.mini import MiniEncoder
from onemap_perception.encoders.projected import ProjectedEncoder, embed_words
from onemap_perception.encoders.protocol import Encoder, ImageEncoder
from onemap_perception.errors import BackendError
from onemap_perception.model_store import locate
from onemap_perception.text.vocabulary import load_vocabulary

if TYPE_CHECKING:
    import torch

    from onemap_perception.encoders.torch_encoder import VisionLanguageModel

PLUGIN_GROUP = "onemap.detectors"  # of entry points
PLUGIN_MEMBERS = ("detector_id", "reads_features", "detect")


def make_encoder(params: EncoderParams) -> ImageEncoder:
    """The configured encoder, warm; raises BackendError."""
    encoder = _make_encoder(params)
    if params.channels == 0:
        return encoder
    # The words of the basis are embedded by one that refuses none of them.
    words_by = MiniEncoder(params, raw=True) if isinstance(params, MiniParams) else encoder
    return with_channels(encoder, params.channels, words_by)


def with_channels(encoder: ImageEncoder, channels: int, words_by: Encoder) -> ImageEncoder:
    """The encoder projected to so many channels, of everyday words as ``words_by`` embeds them."""
    try:
        words = load_vocabulary(SHIPPED).words
    except ValueError as problem:
        raise BackendError(str(problem)) from problem
    return ProjectedEncoder(encoder, embed_words(words_by, words), channels)


def _make_encoder(params: EncoderParams) -> ImageEncoder:
    if isinstance(params, MiniParams):
        return MiniEncoder(params)
    path = locate(params.model, runs_code=isinstance(params, RadioParams))
    from onemap_perception.encoders.checkpoint import open_device
    from onemap_perception.encoders.torch_encoder import TorchEncoder

    return TorchEncoder(_load_model(params, path, open_device(params.device)), params)


def _load_model(params: TorchParams, path: Path, device: torch.device) -> VisionLanguageModel:
    match params:
        case OpenClipConvNextParams():
            from onemap_perception.encoders.openclip_convnext import load_openclip_convnext

            return load_openclip_convnext(path, device)
        case Tipsv2Params():
            from onemap_perception.encoders.tipsv2 import load_tipsv2

            return load_tipsv2(path, device)
        case RadioParams():
            from onemap_perception.encoders.radio import load_radio

            return load_radio(params, path, device)


def make_detector(params: DetectorParams, encoder: Encoder) -> Detector:
    """The configured detector; raises BackendError."""
    match params:
        case PatchesParams():
            return _patch_detector(encoder)
        case CocoParams() | OpenVocabularyParams():
            return _box_detector(params)
        case RoutedParams():
            return RoutedDetector(_box_detector(params.coco), _box_detector(params.open_vocabulary))
        case PluginParams():
            return load_plugin(params.name, params.options)


def _patch_detector(encoder: Encoder) -> Detector:
    queries = encoder.embed_text(("chair",))
    if len(queries.neutral) == 0 or queries.controls:
        raise BackendError(
            "the detector patches needs an encoder calibrated with labels, as mini is; choose "
            "perception.detector.backend: routed, coco, open_vocabulary or plugin"
        )
    return PatchDetector(encoder.encoder_id)


def _box_detector(params: BoxParams) -> BoxDetector:
    path = locate(params.model)
    from onemap_perception.detectors.networks import CocoNetwork, GroundingNetwork
    from onemap_perception.encoders.checkpoint import open_device

    network = CocoNetwork if isinstance(params, CocoParams) else GroundingNetwork
    return BoxDetector(network(path, open_device(params.device)), params)


def load_plugin(name: str, options: Mapping[str, Any]) -> Detector:
    """What the entry point returns when it is called with the options; raises BackendError."""
    installed = {entry.name: entry for entry in entry_points(group=PLUGIN_GROUP)}
    if name not in installed:
        there = ", ".join(sorted(installed)) or "none"
        raise BackendError(f"no installed package has a detector {name!r} (there is: {there})")
    try:
        detector: Detector = installed[name].load()(**options)
    except Exception as problem:  # of another package's code
        raise BackendError(f"the detector {name!r} cannot be loaded: {problem!r}") from problem
    missing = [member for member in PLUGIN_MEMBERS if not hasattr(detector, member)]
    if missing:
        raise BackendError(f"the detector {name!r} lacks {', '.join(missing)}")
    return detector
