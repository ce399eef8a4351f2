"""Whether the packages that a network runs on are installed and can be imported."""

from __future__ import annotations

from onemap_perception.config import PerceptionConfig
from onemap_perception.detectors.params import CocoParams, OpenVocabularyParams, RoutedParams
from onemap_perception.encoders.params import OpenClipConvNextParams, RadioParams, Tipsv2Params
from onemap_perception.errors import ModelError
from onemap_perception.optional_import import OPEN_CLIP, TRANSFORMERS, optional_import


def check_packages(config: PerceptionConfig) -> None:
    """Import what the encoder and the detector need; ModelError with the command to install it."""
    detector = config.detector
    if isinstance(config.encoder, OpenClipConvNextParams):
        with optional_import("open_clip", OPEN_CLIP, backend="openclip_convnext", kind=ModelError):
            import open_clip.model  # noqa: F401
    if isinstance(config.encoder, Tipsv2Params):
        with optional_import(
            "transformers 5.23 or later", TRANSFORMERS, backend="tipsv2", kind=ModelError
        ):
            from transformers import Tipsv2Model  # noqa: F401
    if isinstance(config.encoder, RadioParams):
        with optional_import("transformers", TRANSFORMERS, backend="radio", kind=ModelError):
            from transformers import AutoModel  # noqa: F401
    if isinstance(detector, CocoParams | RoutedParams):
        with optional_import("transformers", TRANSFORMERS, backend="coco", kind=ModelError):
            from transformers import RTDetrV2ForObjectDetection  # noqa: F401
    if isinstance(detector, OpenVocabularyParams | RoutedParams):
        with optional_import(
            "transformers", TRANSFORMERS, backend="open_vocabulary", kind=ModelError
        ):
            from transformers import AutoModelForZeroShotObjectDetection  # noqa: F401
