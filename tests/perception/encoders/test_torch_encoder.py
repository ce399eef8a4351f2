"""Encoders in torch around a model of one layer, and the checkpoints they load."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import torch

from onemap_perception.config import Tipsv2Params
from onemap_perception.encoders.checkpoint import (
    fingerprint,
    load_weights,
    open_device,
    read_weights,
)
from onemap_perception.encoders.torch_encoder import (
    NO_MEAN,
    NO_STD,
    TorchEncoder,
    TorchTower,
    VisionLanguageModel,
)
from onemap_perception.errors import BackendError
from onemap_shared.geometry import F32

STRIDE_PX = 8


class MeanColour(torch.nn.Module):
    """Each patch's mean colour (1, h, w, 3)."""

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        return torch.nn.functional.avg_pool2d(image, STRIDE_PX).permute(0, 2, 3, 1) + 1e-3


def encoder(
    asked: list[str] | None = None,
    *,
    floor: float = 0.0,
) -> TorchEncoder:
    def embed(prompts: Sequence[str]) -> F32:
        (asked if asked is not None else []).extend(prompts)
        return np.array([[len(prompt), 1.0, 0.0] for prompt in prompts], np.float32)

    model = VisionLanguageModel(
        encoder_id="toy",
        text_space="space",
        vision=MeanColour(),
        embed=embed,
        stride_px=STRIDE_PX,
        mean=NO_MEAN,
        std=NO_STD,
    )
    params = Tipsv2Params(model="none", long_side_px=32, floor=floor)
    return TorchEncoder(model, params)


def test_texts_go_through_the_prompt_once_and_compete() -> None:
    asked: list[str] = []
    toy = encoder(asked, floor=0.62)
    asked.clear()  # the words that compete
    queries = toy.embed_text(["gizmo", "thingamajig", "gizmo"])
    toy.embed_text(["thingamajig"])
    assert asked == ["a gizmo", "a thingamajig"]
    assert (queries.encoder_id, queries.text_space) == ("toy", "space")
    assert (queries.texts, queries.floor) == (("gizmo", "thingamajig", "gizmo"), 0.62)
    assert len(queries.neutral) > 100
    np.testing.assert_allclose(np.linalg.norm(queries.embeddings, axis=1), 1, atol=1e-6)


@pytest.mark.parametrize("shape", [(60, 20), (20, 60), (24, 32)])
def test_an_image_is_the_mean_of_the_patches_that_show_it(shape: tuple[int, int]) -> None:
    rgb = np.zeros((*shape, 3), np.uint8)
    rgb[..., 0] = 200
    rgb[: shape[0] // 2, :, 1] = 200
    query = encoder(floor=0.62).embed_image(rgb)
    red, green, blue = query.embeddings[0]
    assert red > green > 0.3  # the half that is yellow counts half
    assert blue < 0.02
    assert (query.neutral.shape, query.floor) == ((0, 3), 0.0)
    assert (query.encoder_id, query.text_space) == ("toy", "space")


class Channels(torch.nn.Module):
    """Each pixel's channels, times ``factor``."""

    def __init__(self, factor: float = 1.0) -> None:
        super().__init__()
        self.factor = factor

    def forward(self, image: torch.Tensor) -> torch.Tensor:
        return image.permute(0, 2, 3, 1) * self.factor


PIXELS = np.random.default_rng(0).random((1, 3, 4, 5)).astype(np.float32) + 0.1


def test_features_that_are_not_finite_are_an_error() -> None:
    with pytest.raises(BackendError, match=r"not finite in torch\.float32"):
        TorchTower(Channels(float("nan")), "cpu")(PIXELS)


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA device")
def test_on_cuda_the_tower_runs_in_half_precision() -> None:
    tower = TorchTower(Channels(), "cuda")
    assert tower.dtype == torch.float16
    on_cpu = TorchTower(Channels(), "cpu")
    np.testing.assert_allclose(tower(PIXELS), on_cpu(PIXELS), atol=2e-3)


@pytest.mark.parametrize("name", ["toaster", "cuda:99"])
def test_a_device_that_does_not_exist_is_an_error(name: str) -> None:
    with pytest.raises(BackendError, match=f"device '{name}' cannot be used"):
        open_device(name)


class Payload:
    """What an attacker would save: unpickling it calls a function."""

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return (print, ("this must never run",))


def test_a_pickled_payload_is_refused_unread(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "evil.pth"
    torch.save({"model": Payload()}, path)
    with pytest.raises(BackendError, match="not a checkpoint of tensors alone"):
        read_weights(path)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("name", ["w.pth", "w.safetensors"])
@pytest.mark.parametrize("content", [b"", b"not a checkpoint", b"PK\x03\x04 cut off"])
def test_corrupt_files_are_refused(name: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(BackendError, match=f"{name} is not a checkpoint"):
        read_weights(path)


def test_a_tensor_of_another_shape_is_named() -> None:
    model = torch.nn.Linear(2, 3)
    weights = {"weight": torch.zeros(3, 5), "bias": torch.zeros(3)}
    with pytest.raises(BackendError, match=r"weight has shape \(3, 5\); expected \(3, 2\)"):
        load_weights(model, weights, Path("w.pth"))


def test_the_fingerprint_follows_values_and_names_not_order() -> None:
    a, b = torch.arange(4.0), torch.ones(2, 2)
    both = fingerprint([("a", a), ("b", b)])
    assert both == fingerprint([("b", b), ("a", a)])
    assert both == fingerprint([("a", a.half()), ("b", b)])  # the same values
    assert both != fingerprint([("a", b), ("b", a)])
    assert both != fingerprint([("a", a + 1), ("b", b)])
