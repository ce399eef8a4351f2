"""Builds the configured encoder and detector; imports torch only for those that need it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from onemap_perception.detectors.params import (
    BoxDetectorParams,
    CocoParams,
    DetectorParams,
    OpenVocabularyParams,
    PatchesParams,
    PluginParams,
    RoutedParams,
)
from onemap_perception.detectors.patches import PatchDetector
from onemap_perception.detectors.plugin import load_plugin
from onemap_perception.detectors.protocol import Detector, DetectorError
from onemap_perception.detectors.router import ClosedVocabularyDetector, RoutedDetector
from onemap_perception.encoders.mini import MiniEncoder, MiniParams
from onemap_perception.encoders.params import (
    EncoderParams,
    OpenClipConvNextParams,
    RadioParams,
    Tipsv2Params,
    TorchEncoderParams,
    TorchParams,
)
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.model_store import locate

if TYPE_CHECKING:
    import torch

    from onemap_perception.encoders.torch_encoder import VisionLanguageModel


def make_encoder(params: EncoderParams) -> Encoder:
    """The configured encoder, warm; raises BackendError."""
    if isinstance(params, MiniParams):
        return MiniEncoder(params)
    path = _model_path(params)
    from onemap_perception.encoders.torch_encoder import TorchEncoder
    from onemap_perception.torch_device import open_device

    return TorchEncoder(_load_model(params, path, open_device(params.device)), params)


def _load_model(params: TorchParams, path: Path, device: torch.device) -> VisionLanguageModel:
    match params:
        case OpenClipConvNextParams():
            from onemap_perception.encoders.openclip_convnext import load_openclip_convnext

            return load_openclip_convnext(params, path, device)
        case Tipsv2Params():
            from onemap_perception.encoders.tipsv2 import load_tipsv2

            return load_tipsv2(path, device)
        case RadioParams():
            from onemap_perception.encoders.radio import load_radio

            return load_radio(params, path, device)


def make_detector(config: DetectorParams, encoder: Encoder) -> Detector:
    """The configured detector; raises Fault."""
    match config:
        case PatchesParams():
            return _patches(config, encoder)
        case CocoParams():
            return _coco(config)
        case OpenVocabularyParams():
            return _open_vocabulary(config)
        case RoutedParams():
            return RoutedDetector(_coco(config.coco), _open_vocabulary(config.open_vocabulary))
        case PluginParams():
            return load_plugin(config.name, config.options)


def _patches(config: PatchesParams, encoder: Encoder) -> Detector:
    if len(encoder.embed_text(("chair",)).neutral) == 0:
        raise DetectorError(
            "the detector patches needs an encoder with calibrated scores (mini); choose "
            "perception.detector.backend: routed, coco, open_vocabulary or plugin"
        )
    return PatchDetector(config.thresholds(), encoder.encoder_id)


def _coco(config: CocoParams) -> ClosedVocabularyDetector:
    from onemap_perception.detectors.coco import CocoDetector, CocoSettings

    return CocoDetector(CocoSettings(_model_path(config), config.device, config.limits()))


def _open_vocabulary(config: OpenVocabularyParams) -> Detector:
    from onemap_perception.detectors.open_vocabulary import (
        OpenVocabularyDetector,
        OpenVocabularySettings,
    )

    return OpenVocabularyDetector(
        OpenVocabularySettings(_model_path(config), config.device, config.limits())
    )


def _model_path(config: TorchEncoderParams | BoxDetectorParams) -> Path:
    return locate(config.model, allow_fetch=config.allow_fetch)
