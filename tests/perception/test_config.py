"""The section ``perception``: defaults, short forms, and mistakes."""

from __future__ import annotations

from typing import Any

import pytest

from onemap_perception.config import PerceptionConfig
from onemap_shared.config import ConfigError, section


def configured(document: dict[str, Any]) -> PerceptionConfig:
    return section({"perception": document}, "perception", PerceptionConfig)


def test_the_default_is_what_ships() -> None:
    config = configured({})
    assert config.encoder.backend == "mini"
    assert config.detector.backend == "patches"
    assert configured({"mini": {"threads": 2}, "patches": {"peak_threshold": 0.7}}) == configured(
        {
            "encoder": {"backend": "mini", "threads": 2},
            "detector": {"backend": "patches", "peak_threshold": 0.7},
        }
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
            {"detector": {"backend": "routed", "coco": {"score_treshold": 0.5}}},
            "perception.detector.coco.score_treshold is unknown; did you mean 'score_threshold'?",
        ),
        (
            {"detector": {"backend": "routed", "coco": {"score": 0.5}}},
            "perception.detector.coco.score is now called 'score_threshold'",
        ),
        ({"silent_after_s": 3}, "perception.silent_after_s is now called 'frame_timeout_s'"),
        ({"patches": {"core": 0.8}}, "perception.detector.core is now called 'peak_threshold'"),
        (
            {"encoder": {"backend": "tipsv2", "model": "x", "kept_texts": 9}},
            "perception.encoder.kept_texts is now called 'text_cache_size'",
        ),
        ({"encoder": {"backend": "tipsv2", "model": "x", "device": "gpu"}}, "should match pattern"),
        ({"encoder": {"backend": "tipsv2", "model": "x", "prompt": "a"}}, "should match pattern"),
        ({"mini": {"colour": 1}}, "perception.encoder.colour is unknown"),
    ],
)
def test_mistakes_are_refused_with_their_path(document: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ConfigError) as refusal:
        configured(document)
    assert sentence in str(refusal.value)
