"""From names to the section ``perception``."""

from __future__ import annotations

import sys

import pytest

from onemap_perception.config import PerceptionConfig
from onemap_perception.errors import BackendError
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.models.choice import check_packages, perception_section

TIPS, LARGE = "google/tipsv2-b14", "google/tipsv2-l14"
COCO, OPEN = "PekingU/rtdetr_v2_r18vd", "iSEE-Laboratory/llmdet_tiny"
OMDET = "omlab/omdet-turbo-swin-tiny-hf"


def part(backend: str, model: str) -> dict[str, str]:
    """The settings of an encoder or a detector."""
    return {"backend": backend, "model": model, "device": "cpu"}


ROUTED, FAST = part("routed", OPEN), part("coco", COCO)


@pytest.mark.parametrize(
    ("names", "section"),
    [
        # An encoder without calibration gets a detector that needs none.
        (["tipsv2"], {"encoder": part("tipsv2", TIPS), "detector": ROUTED}),
        (["google/tipsv2-l14", "coco"], {"encoder": part("tipsv2", LARGE), "detector": FAST}),
        ([OMDET], {"detector": part("open_vocabulary", OMDET)}),
        # A routed detector with another network for one of its halves.
        (["routed", OMDET], {"detector": part("routed", OMDET)}),
    ],
)
def test_names_become_a_section(names: list[str], section: dict[str, object]) -> None:
    assert perception_section(names, "cpu") == section
    PerceptionConfig.model_validate(section)


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
        perception_section(names, "cpu")
    assert sentence in str(error.value)
    assert error.value.exit_code == EXIT_USAGE_ERROR


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
