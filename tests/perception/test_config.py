"""The section ``perception``: defaults, short forms, and mistakes."""

from __future__ import annotations

from typing import Any

import pytest

from onemap_perception.config import (
    CocoParams,
    OpenVocabularyParams,
    PerceptionConfig,
    RoutedParams,
)
from onemap_shared.config import ConfigError, section


def configured(document: dict[str, Any]) -> PerceptionConfig:
    return section({"perception": document}, "perception", PerceptionConfig)


def test_the_default_is_what_ships() -> None:
    config = configured({})
    assert config.encoder.backend == "mini"
    assert config.detector.backend == "patches"
    assert configured({"mini": {"channels": 9}, "patches": {}}) == configured(
        {"encoder": {"backend": "mini", "channels": 9}, "detector": {"backend": "patches"}}
    )


def test_a_routed_detector_is_two() -> None:
    document = {"backend": "routed", "model": "a/b", "device": "cuda", "score_threshold": 0.3}
    detector = configured({"detector": document}).detector
    assert isinstance(detector, RoutedParams)
    assert detector.coco == CocoParams(device="cuda")
    assert detector.open_vocabulary == OpenVocabularyParams(
        model="a/b", device="cuda", score_threshold=0.3
    )


@pytest.mark.parametrize(
    ("document", "sentence"),
    [
        (
            {"encoder": {"backend": "openclip_convnext", "modle": "x", "model": "x"}},
            "perception.encoder.modle is unknown; did you mean 'model'?",
        ),
        ({"encoder": {"backend": "mini", "thread": 1}}, "perception.encoder.thread is unknown"),
        ({"encoder": {"backend": "clip"}}, "perception.encoder: Input tag 'clip'"),
        ({"encoder": {"backend": "tipsv2"}}, "perception.encoder.model: Field required"),
        (
            {"detector": {"backend": "routed", "score_treshold": 0.5}},
            "perception.detector.score_treshold is unknown; did you mean 'score_threshold'?",
        ),
        ({"frame_timeout_s": 3}, "perception.frame_timeout_s is unknown; there are encoder, "),
        ({"patches": {"min_patches": 2}}, "most keys of 0.1 are constants since 0.2.0"),
        ({"encoder": {"backend": "tipsv2", "model": "x", "device": "gpu"}}, "should match pattern"),
        ({"mini": {"colour": 1}}, "perception.encoder.colour is unknown"),
    ],
)
def test_mistakes_are_refused_with_their_path(document: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ConfigError) as refusal:
        configured(document)
    assert sentence in str(refusal.value)
