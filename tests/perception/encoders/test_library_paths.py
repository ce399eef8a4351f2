"""What our loading paths give is what the libraries' own code gives."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from tests.perception.library_paths import (
    Agreement,
    compare_openclip,
    compare_tipsv2,
    openclip_folder,
    tipsv2_folder,
)
from tests.perception.tiny import needs_open_clip

pytestmark = [needs_open_clip, pytest.mark.slow]
SMALL_CONVNEXT: dict[str, Any] = {
    "vision_cfg": {"timm_model_name": "convnext_atto"},
    "text_cfg": {"width": 64, "heads": 2, "layers": 2},
}
SMALL = {"hidden_size": 64, "num_hidden_layers": 3, "num_attention_heads": 2}


def check(agreement: Agreement) -> None:
    assert agreement.pixels < 1e-6
    assert min(agreement.patches, agreement.texts) > 1 - 1e-6
    assert agreement.spread < 0.995  # else all would be alike, and the cosines say nothing


def test_openclip_is_as_open_clip_runs_it(tmp_path: Path) -> None:
    check(compare_openclip(openclip_folder(tmp_path, "convnext_large_d_320", SMALL_CONVNEXT)))


def test_openclip_follows_its_whole_configuration(tmp_path: Path) -> None:
    """A linear head in place of an MLP, and what the weights of the hub leave at its default."""
    changes = deepcopy(SMALL_CONVNEXT)
    changes["text_cfg"] |= {"tokenizer_kwargs": {"clean": "canonicalize"}}
    preprocess = {"mean": [0.5, 0.4, 0.3], "std": [0.5, 0.4, 0.3]}
    folder = openclip_folder(tmp_path, "convnext_base_w", changes, preprocess, quick_gelu=True)
    check(compare_openclip(folder))


def test_tipsv2_is_as_transformers_runs_it(tmp_path: Path) -> None:
    check(compare_tipsv2(tipsv2_folder(tmp_path, SMALL, text_layers=2)))
