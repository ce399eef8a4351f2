"""``TorchEncoder`` around a model of one layer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
import torch

from onemap_perception.encoders.params import Tipsv2Params
from onemap_perception.encoders.torch_encoder import (
    NO_MEAN,
    NO_STD,
    TorchEncoder,
    VisionLanguageModel,
)
from onemap_shared.geometry import F16, F32

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


@pytest.mark.parametrize(
    ("height", "width", "rows", "columns"), [(24, 32, 3, 4), (480, 640, 3, 4), (64, 32, 4, 2)]
)
def test_the_shape_of_the_image_is_kept(height: int, width: int, rows: int, columns: int) -> None:
    features = encoder().encode(np.full((height, width, 3), 9, np.uint8))
    assert features.shape == (rows, columns, 3)
    assert features.dtype == np.float16


def test_features_are_unit_vectors_in_the_layout_of_the_image() -> None:
    rgb = np.zeros((24, 32, 3), np.uint8)
    rgb[:, :16, 0] = 255
    rgb[:, 16:, 1] = 255
    features = encoder().encode(rgb).astype(np.float32)
    assert features[:, :2, 0].min() > 0.99
    assert features[:, 2:, 1].min() > 0.99
    np.testing.assert_allclose(np.linalg.norm(features, axis=-1), 1, atol=2e-3)


def test_texts_go_through_the_prompt_once_and_score_as_cosines() -> None:
    asked: list[str] = []
    toy = encoder(asked, floor=0.62)
    queries = toy.embed_text(["sofa", "lamp", "sofa"])
    toy.embed_text(["lamp"])
    assert asked == ["a sofa", "a lamp"]
    assert (queries.encoder_id, queries.text_space) == ("toy", "space")
    assert (queries.texts, queries.floor) == (("sofa", "lamp", "sofa"), 0.62)
    assert queries.neutral.shape == (0, 3)
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


def test_images_of_any_shape_have_the_size_that_the_tower_was_made_for() -> None:
    toy, sizes = encoder(), set[tuple[int, ...]]()
    tower = toy.tower

    def watched(pixel_values: F32) -> F16:
        sizes.add(pixel_values.shape)
        return tower(pixel_values)

    toy.tower = watched
    for height, width in ((16, 90), (90, 16), (240, 320)):
        toy.embed_image(np.full((height, width, 3), 90, np.uint8))
    assert sizes == {(1, 3, 24, 32)}
