"""From the configuration to the encoder and the detector. Libraries load when they are used."""

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
from onemap_perception.encoders.mini import MiniEncoder
from onemap_perception.encoders.params import (
    EncoderParams,
    MiniParams,
    OpenClipConvNextParams,
    RadioParams,
    Tipsv2Params,
    TorchEncoderParams,
)
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.model_store import locate

if TYPE_CHECKING:
    from onemap_perception.encoders.torch_tower import TowerParams


def make_encoder(config: EncoderParams) -> Encoder:
    """The configured encoder, warm; raises Fault."""
    match config:
        case MiniParams():
            return MiniEncoder(config.settings())
        case OpenClipConvNextParams():
            return _openclip_convnext(config)
        case Tipsv2Params():
            return _tipsv2(config)
        case RadioParams():
            return _radio(config)


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


def _openclip_convnext(config: OpenClipConvNextParams) -> Encoder:
    from onemap_perception.encoders.openclip_convnext import OpenClipConvNext, OpenClipSettings

    return OpenClipConvNext(
        OpenClipSettings(
            weights=_model_path(config),
            architecture=config.architecture,
            long_side_px=config.long_side_px,
            sed_compat=config.sed_compat,
            prompt=config.prompt,
            kept_texts=config.kept_texts,
            floor=config.floor,
            tower=_tower(config),
        )
    )


def _tipsv2(config: Tipsv2Params) -> Encoder:
    from onemap_perception.encoders.tipsv2 import Tipsv2Encoder, Tipsv2Settings

    return Tipsv2Encoder(
        Tipsv2Settings(
            folder=_model_path(config),
            long_side_px=config.long_side_px,
            prompt=config.prompt,
            kept_texts=config.kept_texts,
            floor=config.floor,
            tower=_tower(config),
        )
    )


def _radio(config: RadioParams) -> Encoder:
    from onemap_perception.encoders.radio import RadioEncoder, RadioSettings

    return RadioEncoder(
        RadioSettings(
            folder=_model_path(config),
            allow_remote_code=config.allow_remote_code,
            long_side_px=config.long_side_px,
            prompt=config.prompt,
            kept_texts=config.kept_texts,
            floor=config.floor,
            tower=_tower(config),
        )
    )


def _tower(config: TorchEncoderParams) -> TowerParams:
    from onemap_perception.encoders.torch_tower import TowerParams

    return TowerParams(
        device=config.device,
        compiled=config.compiled,
        warm_up_px=config.warm_up_px,
        exported=config.exported,
        provider=config.provider,
    )


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
