"""Builds the configured encoder and detector; imports torch only for those that need it."""
# Touches files: entry points of installed packages.

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import entry_points
from typing import Any

from onemap_perception.config import (
    SHIPPED,
    BoxParams,
    DetectorParams,
    EncoderParams,
    MiniParams,
    PatchesParams,
    PluginEncoderParams,
    PluginParams,
    RoutedParams,
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

# By kind: the members that what an entry point of the group ``onemap.<kind>s`` returns must have.
PLUGIN_MEMBERS = {
    "encoder": ("encoder_id", "text_space", "encode", "embed_text", "embed_image"),
    "detector": ("detector_id", "reads_features", "detect"),
}


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
    if isinstance(params, PluginEncoderParams):
        plugin: ImageEncoder = load_plugin("encoder", params.name, params.options)
        return plugin
    path = locate(params.model, params.files)
    from onemap_perception.encoders.checkpoint import open_device
    from onemap_perception.encoders.torch_encoder import TorchEncoder

    return TorchEncoder(params.load(path, open_device(params.device)), params)


def make_detector(params: DetectorParams, encoder: Encoder) -> Detector:
    """The configured detector; raises BackendError."""
    match params:
        case PatchesParams():
            return _patch_detector(encoder)
        case RoutedParams():
            return RoutedDetector(_box_detector(params.coco), _box_detector(params.open_vocabulary))
        case PluginParams():
            plugin: Detector = load_plugin("detector", params.name, params.options)
            return plugin
        case _:
            return _box_detector(params)


def _patch_detector(encoder: Encoder) -> Detector:
    queries = encoder.embed_text(("chair",))
    if len(queries.neutral) == 0 or queries.controls:
        raise BackendError(
            "the detector patches needs an encoder calibrated with labels, as mini is; choose "
            "perception.detector.backend: routed, coco, open_vocabulary or plugin"
        )
    return PatchDetector(encoder.encoder_id)


def _box_detector(params: BoxParams) -> BoxDetector:
    path = locate(params.model, params.files)
    from onemap_perception.encoders.checkpoint import open_device

    return BoxDetector(params.load(path, open_device(params.device)), params)


def load_plugin(kind: str, name: str, options: Mapping[str, Any]) -> Any:
    """What the entry point returns when it is called with the options; raises BackendError.

    kind: encoder or detector.
    """
    installed = {entry.name: entry for entry in entry_points(group=f"onemap.{kind}s")}
    if name not in installed:
        there = ", ".join(sorted(installed)) or "none"
        raise BackendError(f"no installed package has the {kind} {name!r} (there is: {there})")
    try:
        plugin = installed[name].load()(**options)
    except Exception as problem:  # of another package's code
        raise BackendError(f"the {kind} {name!r} cannot be loaded: {problem!r}") from problem
    missing = [member for member in PLUGIN_MEMBERS[kind] if not hasattr(plugin, member)]
    if missing:
        raise BackendError(f"the {kind} {name!r} lacks {', '.join(missing)}")
    return plugin
