"""From names to the section ``perception``."""

from __future__ import annotations

import sys
from typing import Any

import pytest

from onemap_perception.config import KNOWN_MODELS, PerceptionConfig
from onemap_perception.errors import BackendError
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.models.choice import ModelChoice, check_packages, choose, perception_section

TIPS = "google/tipsv2-b14"
COCO, OPEN = "PekingU/rtdetr_v2_r18vd", "iSEE-Laboratory/llmdet_tiny"
ROUTED = {"backend": "routed", "model": OPEN, "device": "cpu"}


def section(before: dict[str, Any], *names: str, device: str = "cpu") -> dict[str, Any]:
    """The section after these names; it is valid."""
    after = perception_section(before, choose(names), device)
    PerceptionConfig.model_validate(after)
    return after


def test_hub_ids_and_an_encoder_with_a_detector() -> None:
    assert choose(["google/tipsv2-l14", "routed"]) == ModelChoice(
        "tipsv2", "google/tipsv2-l14", {"coco": COCO, "open_vocabulary": OPEN}
    )
    omdet = "omlab/omdet-turbo-swin-tiny-hf"
    assert choose([omdet]) == ModelChoice(detectors={"open_vocabulary": omdet})
    # A routed detector with another network for one of its halves.
    assert choose(["routed", omdet]).detectors == {"coco": COCO, "open_vocabulary": omdet}


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        (["tipsv3"], "There is no model 'tipsv3'; did you mean 'tipsv2'?"),
        (["Google/TIPSv2-B14x"], "did you mean 'google/tipsv2-b14'?"),
        (["openclip"], "did you mean 'openclip_convnext'?"),
        (["zzzz"], "there are openclip_convnext, tipsv2, coco, open_vocabulary, routed"),
        (
            ["tipsv2", "openclip_convnext"],
            "tipsv2 and openclip_convnext are both encoders: name one",
        ),
        (["coco", "open_vocabulary"], "both detectors: name one, or routed to run both"),
    ],
)
def test_other_names_are_refused(names: list[str], sentence: str) -> None:
    with pytest.raises(CliError) as error:
        choose(names)
    assert sentence in str(error.value)
    assert error.value.exit_code == EXIT_USAGE_ERROR


def test_an_encoder_without_calibration_gets_a_detector_that_needs_none() -> None:
    encoder = {"backend": "tipsv2", "model": TIPS, "device": "cpu"}
    assert section({}, "tipsv2") == {"encoder": encoder, "detector": ROUTED}
    assert section({"patches": {}}, "tipsv2")["detector"] == ROUTED
    plugin = {"backend": "plugin", "name": "mine"}
    assert section({"detector": plugin}, "tipsv2")["detector"] == plugin


def test_settings_of_another_network_go_but_for_those_that_last() -> None:
    before = {
        "encoder": {"backend": "tipsv2", "model": TIPS, "floor": 0.6, "channels": 128},
        "detector": {"backend": "coco", "score_threshold": 0.7},
    }
    after = section(before, "openclip_convnext", "open_vocabulary")
    kept = {"model": KNOWN_MODELS[0].repo, "device": "cpu", "channels": 128}
    assert after["encoder"] == {"backend": "openclip_convnext", **kept}
    assert after["detector"] == {"backend": "open_vocabulary", "model": OPEN, "device": "cpu"}


@pytest.mark.parametrize(
    ("document", "package", "sentence"),
    [
        (
            {"encoder": {"backend": "openclip_convnext", "model": "a/b"}},
            "open_clip.model",
            r"openclip_convnext needs open_clip, .*\[openclip\]",
        ),
        (
            {"encoder": {"backend": "tipsv2", "model": "a/b"}},
            "transformers",
            r"tipsv2 needs transformers 5\.23 or later, .*\[transformers\]",
        ),
        (
            {"detector": {"backend": "routed"}},
            "transformers",
            "coco needs transformers, .*pip install --no-deps -r requirements/encoders",
        ),
    ],
)
def test_a_missing_package_is_named(
    document: dict[str, object], package: str, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(BackendError, match=sentence):
        check_packages(PerceptionConfig.model_validate(document))
