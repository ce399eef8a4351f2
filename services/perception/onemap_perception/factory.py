"""From the configuration to the encoder and the detector. Libraries load when they are used."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from onemap_perception.detectors.params import (
    BoxesConfig,
    CocoConfig,
    DetectorConfig,
    OpenVocabularyConfig,
    PatchesConfig,
    PluginConfig,
    RoutedConfig,
)
from onemap_perception.detectors.patches import PatchDetector
from onemap_perception.detectors.plugin import load_plugin
from onemap_perception.detectors.protocol import Detector, DetectorError
from onemap_perception.detectors.router import RoutedDetector, Specialist
from onemap_perception.encoders.mini import MiniEncoder
from onemap_perception.encoders.params import (
    EncoderConfig,
    MiniConfig,
    OpenClipConvNextConfig,
    RadioConfig,
    Tipsv2Config,
    TorchConfig,
)
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.model_store import locate

if TYPE_CHECKING:
    from onemap_perception.encoders.torch_tower import TowerSettings


def make_encoder(config: EncoderConfig) -> Encoder:
    """The configured encoder, warm; raises Fault."""
    match config:
        case MiniConfig():
            return MiniEncoder(config.settings())
        case OpenClipConvNextConfig():
            return _openclip_convnext(config)
        case Tipsv2Config():
            return _tipsv2(config)
        case RadioConfig():
            return _radio(config)


def make_detector(config: DetectorConfig, encoder: Encoder) -> Detector:
    """The configured detector; raises Fault."""
    match config:
        case PatchesConfig():
            return _patches(config, encoder)
        case CocoConfig():
            return _coco(config)
        case OpenVocabularyConfig():
            return _open_vocabulary(config)
        case RoutedConfig():
            return RoutedDetector(_coco(config.coco), _open_vocabulary(config.open_vocabulary))
        case PluginConfig():
            return load_plugin(config.name, config.options)


def _openclip_convnext(config: OpenClipConvNextConfig) -> Encoder:
    from onemap_perception.encoders.openclip_convnext import OpenClipConvNext, OpenClipSettings

    return OpenClipConvNext(
        OpenClipSettings(
            weights=_place(config),
            architecture=config.architecture,
            long_side_px=config.long_side_px,
            sed_compat=config.sed_compat,
            prompt=config.prompt,
            kept_texts=config.kept_texts,
            floor=config.floor,
            tower=_tower(config),
        )
    )


def _tipsv2(config: Tipsv2Config) -> Encoder:
    from onemap_perception.encoders.tipsv2 import Tipsv2Encoder, Tipsv2Settings

    return Tipsv2Encoder(
        Tipsv2Settings(
            folder=_place(config),
            long_side_px=config.long_side_px,
            prompt=config.prompt,
            kept_texts=config.kept_texts,
            floor=config.floor,
            tower=_tower(config),
        )
    )


def _radio(config: RadioConfig) -> Encoder:
    from onemap_perception.encoders.radio import RadioEncoder, RadioSettings

    return RadioEncoder(
        RadioSettings(
            folder=_place(config),
            allow_remote_code=config.allow_remote_code,
            long_side_px=config.long_side_px,
            prompt=config.prompt,
            kept_texts=config.kept_texts,
            floor=config.floor,
            tower=_tower(config),
        )
    )


def _tower(config: TorchConfig) -> TowerSettings:
    from onemap_perception.encoders.torch_tower import TowerSettings

    return TowerSettings(
        device=config.device,
        compiled=config.compiled,
        warm_up_px=config.warm_up_px,
        exported=config.exported,
        provider=config.provider,
    )


def _patches(config: PatchesConfig, encoder: Encoder) -> Detector:
    if len(encoder.embed_text(("chair",)).neutral) == 0:
        raise DetectorError(
            "the detector patches needs an encoder with calibrated scores (mini); choose "
            "perception.detector.backend: routed, coco, open_vocabulary or plugin"
        )
    return PatchDetector(config.thresholds(), encoder.encoder_id)


def _coco(config: CocoConfig) -> Specialist:
    from onemap_perception.detectors.coco import CocoDetector, CocoSettings

    return CocoDetector(CocoSettings(_place(config), config.device, config.limits()))


def _open_vocabulary(config: OpenVocabularyConfig) -> Detector:
    from onemap_perception.detectors.open_vocabulary import (
        OpenVocabularyDetector,
        OpenVocabularySettings,
    )

    return OpenVocabularyDetector(
        OpenVocabularySettings(_place(config), config.device, config.limits())
    )


def _place(config: TorchConfig | BoxesConfig) -> Path:
    return locate(config.model, allow_fetch=config.allow_fetch)
