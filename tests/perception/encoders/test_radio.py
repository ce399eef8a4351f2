"""The seam to C-RADIO. Its own code is not here: a stand-in has the interface it documents."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

from onemap_perception.config import PerceptionConfig, RadioParams
from onemap_perception.encoders import radio
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder


def test_without_the_flag_nothing_is_read(tmp_path: Path) -> None:
    (tmp_path / "config.json").write_text("not even JSON")
    config = PerceptionConfig.model_validate(
        {"encoder": {"backend": "radio", "model": str(tmp_path)}}
    )
    with pytest.raises(BackendError, match="allow_remote_code: true"):
        make_encoder(config.encoder)


@pytest.mark.parametrize(
    ("config", "said"),
    [
        (
            '{"auto_map": {"AutoModel": "other/repo--hf_model.RADIOModel"}}',
            "repository, other/repo",
        ),
        ("{}", "names no code"),
        ("no JSON", "names no code"),
    ],
)
def test_code_of_another_repository_is_not_run(tmp_path: Path, config: str, said: str) -> None:
    (tmp_path / "config.json").write_text(config)
    params = RadioParams(model=str(tmp_path), allow_remote_code=True)
    with pytest.raises(BackendError, match=said):
        make_encoder(params)


class Adaptor(torch.nn.Module):
    def tokenizer(self, prompts: list[str]) -> torch.Tensor:
        return torch.tensor([[float(len(prompt))] for prompt in prompts])

    def encode_text(self, tokens: torch.Tensor) -> torch.Tensor:
        return torch.cat([tokens, torch.ones_like(tokens)], dim=1)


class StandIn(torch.nn.Module):
    """Each patch's mean colour, as (summary, features) of the adaptor."""

    def __init__(self) -> None:
        super().__init__()
        self.scale = torch.nn.Parameter(torch.ones(1))
        self.radio_model = SimpleNamespace(adaptors={radio.ADAPTOR: Adaptor()})

    def forward(self, image: torch.Tensor) -> dict[str, Any]:
        cells = torch.nn.functional.avg_pool2d(image * self.scale, radio.STRIDE)
        features = cells.flatten(2).transpose(1, 2)[..., :2]
        return {radio.ADAPTOR: (features.mean(1), features)}


def test_features_are_laid_out_as_the_image(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(radio, "read_model", lambda folder: StandIn())
    params = RadioParams(model=str(tmp_path), allow_remote_code=True, long_side_px=64)
    encoder = make_encoder(params)
    rgb = np.full((48, 64, 3), (255, 0, 0), np.uint8)
    rgb[:, 32:] = (0, 255, 0)
    features = encoder.encode(rgb)
    assert features.shape == (3, 4, 2)
    assert features[:, :2, 0].min() > 0.99
    assert features[:, 2:, 1].min() > 0.99
    reply = encoder.embed_text(["sofa"])
    assert (reply.encoder_id, reply.text_space) == (encoder.encoder_id, radio.ADAPTOR)
    np.testing.assert_allclose(np.linalg.norm(reply.embeddings, axis=1), 1, atol=1e-6)
