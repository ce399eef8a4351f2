from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from onemap_shared import messages as m
from tests.shared.samples import SAMPLES


def sample(cls: type) -> Any:
    return next(message for message in SAMPLES if isinstance(message, cls))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "empty"),
        ("  \n\t ", "empty"),
        ("a" * 10_000, "10000 characters; the limit is 200"),
        ("12 34", "no readable word"),
        ("so\x00fa", "no readable word"),
        ("\u202esofa", "no readable word"),
    ],
)
def test_texts_that_name_nothing_are_refused(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        m.check_text(text)


def test_a_text_that_is_no_string_is_refused() -> None:
    with pytest.raises(ValueError, match="must be a string, not int"):
        m.check_text(7)  # type: ignore[arg-type]


@pytest.mark.parametrize("text", ["sofa", "  teddy\n bear ", "Kühlschrank", "冷蔵庫", "tv 2"])
def test_names_in_any_language_are_accepted(text: str) -> None:
    assert m.check_text(text) == " ".join(text.split())


WRONG: dict[str, tuple[type, dict[str, Any], str]] = {
    "rgb dtype": (m.RgbdFrame, {"rgb": np.zeros((6, 8, 3), np.float32)}, "rgb has dtype float32"),
    "rgb grey": (m.RgbdFrame, {"rgb": np.zeros((6, 8, 1), np.uint8)}, "rgb has shape"),
    "depth size": (m.RgbdFrame, {"depth_mm": np.zeros((3, 4), np.uint16)}, "depth_mm has shape"),
    "mirrored pose": (m.Odometry, {"T_map_body": np.diag([1.0, 1.0, -1.0, 1.0])}, "reflection"),
    "velocity": (m.VelocityCommand, {"linear_mps": float("nan")}, "velocity is NaN"),
    "empty field": (m.FeatureField, {"features": np.zeros((0, 3, 4), np.float16)}, "empty"),
    "owner": (m.Detections, {"point_owner": np.array([0, 1, 2], np.int32)}, "point_owner"),
    "no texts": (m.TextRequest, {"texts": ()}, "between 1 and 256"),
    "no objects": (m.SearchRequest, {"objects": ()}, "between 1 and 20"),
    "an empty object": (m.SearchRequest, {"objects": ("sofa", " ")}, "object name is empty"),
    "regions": (m.SimilarityRequest, {"max_regions": 0}, "max_regions"),
    "occupancy": (m.SearchView, {"occupancy": np.zeros((1, 1), np.uint8)}, "occupancy has shape"),
    "neutral": (m.TextEmbeddings, {"neutral": np.zeros((3, 5), np.float32)}, "neutral has shape"),
    "floor": (m.TextEmbeddings, {"floor": 1.2}, "floor is 1.2"),
    "no floor": (m.TextEmbeddings, {"floor": float("nan")}, "floor is nan"),
    "nearest": (m.TextEmbeddings, {"nearest": ((), ())}, "nearest has 2 entries for 1 texts"),
    "best score": (m.SimilarityReply, {"best_score": -0.1}, "best_score is -0.1"),
    "reply's floor": (m.SimilarityReply, {"floor": 2.0}, "floor is 2.0"),
}


@pytest.mark.parametrize("case", WRONG)
def test_an_invalid_message_cannot_be_built(case: str) -> None:
    cls, changes, reason = WRONG[case]
    with pytest.raises(ValueError, match=reason):
        dataclasses.replace(sample(cls), **changes)


def test_a_frame_without_pixels_is_refused() -> None:
    with pytest.raises(ValueError, match="no pixels"):
        dataclasses.replace(
            sample(m.RgbdFrame),
            rgb=np.zeros((0, 8, 3), np.uint8),
            depth_mm=np.zeros((0, 8), np.uint16),
        )


def test_a_status_knows_its_target_while_active() -> None:
    status = sample(m.SearchStatus)
    assert isinstance(status, m.SearchStatus)
    assert (status.active, status.target) == (True, "bed")
    for state in m.FINAL_STATES:
        ended = dataclasses.replace(status, state=state)
        assert (ended.active, ended.target) == (False, "")


@pytest.mark.parametrize(
    ("message", "field"),
    [
        (m.TextRequest((" red  sofa",)), "texts"),
        (m.SearchRequest(("red\tsofa ",)), "objects"),
        (m.SearchViewRequest("sofa", ("red  sofa",)), "rivals"),
    ],
)
def test_messages_hold_clean_texts(message: object, field: str) -> None:
    assert getattr(message, field) == ("red sofa",)


def test_a_query_s_text_is_clean() -> None:
    assert m.SimilarityRequest(" red  sofa ").text == "red sofa"
    assert m.SearchViewRequest("  sofa").text == "sofa"


def test_a_search_status_names_readable_objects() -> None:
    status = sample(m.SearchStatus)
    with pytest.raises(ValueError, match="object name holds no readable word"):
        dataclasses.replace(status, objects=("12",))
