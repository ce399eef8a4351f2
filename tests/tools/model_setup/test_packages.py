"""Missing packages become a sentence with the command that installs them."""

from __future__ import annotations

import sys

import pytest

from onemap_perception.config import PerceptionConfig
from onemap_perception.errors import ModelError
from onemap_tools.model_setup.packages import check_packages

OPENCLIP = {"encoder": {"backend": "openclip_convnext", "model": "a/b"}}
TIPS = {"encoder": {"backend": "tipsv2", "model": "a/b"}}
RADIO = {"encoder": {"backend": "radio", "model": "a/b"}}


@pytest.mark.parametrize(
    ("document", "package", "sentence"),
    [
        (OPENCLIP, "open_clip.model", r"openclip_convnext needs open_clip, .*onemap\[openclip\]"),
        (TIPS, "transformers", r"tipsv2 needs transformers 5\.23 or later, .*\[transformers\]"),
        (RADIO, "transformers", r"radio needs transformers, "),
        ({"detector": {"backend": "coco"}}, "transformers", "coco needs transformers, "),
        ({"detector": {"backend": "routed"}}, "transformers", "coco needs transformers, "),
        (
            {"detector": {"backend": "open_vocabulary"}},
            "transformers",
            r"open_vocabulary needs transformers, .*pip install --no-deps -r requirements-encoders",
        ),
    ],
)
def test_a_missing_package_is_named(
    document: dict[str, object], package: str, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ModelError, match=sentence):
        check_packages(PerceptionConfig.model_validate(document))


def test_mini_needs_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    for package in ("transformers", "open_clip"):
        monkeypatch.setitem(sys.modules, package, None)
    check_packages(PerceptionConfig())
