"""Fields, detections and embeddings whose parts do not fit together are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from onemap_shared.messages import (
    MAX_PICTURE_BYTES,
    Detections,
    FeatureField,
    TextEmbeddings,
    TextRequest,
)
from tests.shared.messages.broken import assert_refused, sample


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"features": np.zeros((0, 3, 4), np.float16)}, "empty"),
        ({"features": np.full((2, 3, 4), np.nan, np.float16)}, "features contains NaN"),
        ({"variance": np.zeros((6, 8), np.float32)}, "variance must be positive"),
        ({"variance": np.full((6, 8), np.nan, np.float32)}, "variance must be positive"),
        ({"variance": np.full((6, 8), 1e-38, np.float32)}, "1e-06 to 1e.12"),
        ({"variance": np.full((6, 8), 3e38, np.float32)}, "1e-06 to 1e.12"),
        ({"variance": np.full((6, 8), -np.inf, np.float32)}, "variance must be positive"),
        ({"depth_mm": np.zeros((3, 4), np.uint16)}, "depth_mm has shape"),
    ],
)
def test_a_damaged_field_is_refused(changes: dict[str, Any], reason: str) -> None:
    assert_refused(FeatureField, reason, **changes)


def test_points_belong_to_detections_of_the_frame() -> None:
    assert_refused(Detections, "point_owner", point_owner=np.array([0, 1, 2], np.int32))
    assert_refused(Detections, "point_owner", point_owner=np.array([0, -1, 1], np.int32))


def test_a_picture_is_no_larger_than_its_frame() -> None:
    for scale in (0.0, 1.5, float("nan")):
        assert_refused(Detections, "picture_scale", picture_scale=scale)
    assert_refused(Detections, "make it smaller", picture=bytes(MAX_PICTURE_BYTES + 1))


@pytest.mark.parametrize("count", [0, 257])
def test_a_request_holds_1_to_256_texts(count: int) -> None:
    assert_refused(TextRequest, "between 1 and 256", texts=("sofa",) * count)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"neutral": np.zeros((3, 5), np.float32)}, "neutral has shape"),
        ({"floor": 1.2}, "floor is 1.2"),
        ({"floor": float("nan")}, "floor is nan"),
        ({"nearest": ((), ())}, "nearest has 2 entries for 1 texts"),
    ],
)
def test_damaged_embeddings_are_refused(changes: dict[str, Any], reason: str) -> None:
    assert_refused(TextEmbeddings, reason, **changes)


def embeddings(rows: list[list[float]], competing: list[list[int]]) -> TextEmbeddings:
    """Embeddings of the texts a, b, c with these rows of ``neutral_mask``."""
    mask = np.array(competing, np.uint8).reshape(3, -1)
    return TextEmbeddings(
        "e",
        "s",
        ("a", "b", "c"),
        np.array(rows, np.float32),
        np.zeros((mask.shape[1], 2), np.float32),
        mask,
        1.0,
        nearest=((), ("x",), ()),
    )


def test_texts_that_spare_the_same_neutral_word_mean_the_same() -> None:
    found = embeddings([[1, 0], [0, 1], [1, 0]], [[0, 1], [0, 1], [1, 1]]).same_meaning()
    assert found.tolist() == [[True, True, False], [True, True, False], [False, False, True]]


def test_without_neutral_words_the_cosine_decides() -> None:
    found = embeddings([[1, 0], [0.95, 0.31225], [0, 1]], [[], [], []]).same_meaning()
    assert found.tolist() == [[True, True, False], [True, True, False], [False, False, True]]


def test_some_of_the_texts_keep_their_rows() -> None:
    some = embeddings([[1, 0], [0.6, 0.8], [0, 1]], [[0], [1], [1]]).only(np.array([1, 2]))
    assert some.texts == ("b", "c")
    assert some.nearest == (("x",), ())
    np.testing.assert_array_equal(some.embeddings, np.array([[0.6, 0.8], [0, 1]], np.float32))
    assert some.neutral_mask.tolist() == [[1], [1]]
    assert sample(TextEmbeddings).only(np.array([0])).texts == ("sofa",)
