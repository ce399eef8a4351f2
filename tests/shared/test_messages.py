"""Messages check themselves when they are built; what they say of their content."""

from __future__ import annotations

import dataclasses
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_shared import messages as m
from onemap_shared.grid import GridSpec
from onemap_shared.messages.checks import finite, image_size_px
from onemap_shared.wire import decode, encode
from tests.shared.samples import sample

NAN, INF = float("nan"), float("inf")
MIRRORED = np.diag([1.0, 1.0, -1.0, 1.0])
SMALL = np.zeros((1, 1), np.uint8)


def f(*shape: int, value: float = 0.0) -> np.ndarray:
    return np.full(shape, value, np.float32)


def u8(*shape: int) -> np.ndarray:
    return np.zeros(shape, np.uint8)


PLACE = {"kind": m.SearchKind.LOOK_AT}
# A change of the sample of this type, and why it is refused.
IMPOSSIBLE: list[tuple[type[Any], str, dict[str, Any]]] = [
    (m.RgbdFrame, "rgb has dtype float32", {"rgb": f(6, 8, 3)}),
    (m.RgbdFrame, "rgb has shape", {"rgb": u8(6, 8, 1)}),
    (m.RgbdFrame, "depth_mm has shape", {"depth_mm": np.zeros((3, 4), np.uint16)}),
    (m.RgbdFrame, "T_map_camera.*reflection", {"T_map_camera": MIRRORED}),
    (m.RgbdFrame, "no pixels", {"rgb": u8(0, 8, 3), "depth_mm": np.zeros((0, 8), np.uint16)}),
    (m.Odometry, "reflection", {"T_map_body": MIRRORED}),
    (m.Odometry, "planner has 65 characters", {"planner": "x" * 65}),
    (m.VelocityCommand, "planner has 9 characters", {"planner": "two\nlines"}),
    (m.VelocityCommand, "linear_mps contains NaN", {"linear_mps": NAN}),
    (m.VelocityCommand, "validity_ms is 301; .* at most 300", {"validity_ms": 301}),
    (m.VelocityCommand, "validity_ms is -1; .* at least 0", {"validity_ms": -1}),
    (m.VelocityCommand, "lateral_mps contains NaN or infinity", {"lateral_mps": INF}),
    (
        m.FeatureField,
        "is empty",
        {"features": np.zeros((0, 3, 4), np.float16), "colours": u8(0, 3, 3)},
    ),
    (m.FeatureField, "features contains", {"features": np.full((2, 3, 4), NAN, np.float16)}),
    (m.FeatureField, "variance must be positive", {"variance": f(6, 8)}),
    (m.FeatureField, "variance must be positive", {"variance": f(6, 8, value=NAN)}),
    (m.FeatureField, "1e-06 to 1e.12", {"variance": f(6, 8, value=3e38)}),
    (m.Detections, "point_owner", {"point_owner": np.array([0, 1, 2], np.int32)}),
    (m.Detections, "point_owner", {"point_owner": np.array([0, -1, 1], np.int32)}),
    (m.Detections, "points_map lies beyond", {"points_map": np.full((3, 3), -1e20, np.float32)}),
    (m.Detections, "boxes_px has shape", {"names": ("sofa",)}),
    (m.Detections, "picture_scale is 0.0; it must be above 0", {"picture_scale": 0.0}),
    (m.Detections, "make it smaller", {"picture": bytes(m.MAX_PICTURE_BYTES + 1)}),
    (m.TextRequest, "0 texts; between 1 and 256", {"texts": ()}),
    (m.TextRequest, "257 texts; between 1 and 256", {"texts": ("sofa",) * 257}),
    (m.TextEmbeddings, "neutral has shape", {"neutral": f(3, 5)}),
    (m.TextEmbeddings, "floor is nan; it must be at least 0, at most 1", {"floor": NAN}),
    (m.ImageRequest, "no PNG", {"image": b"sofa"}),
    (m.ImageRequest, "the limit is 524288", {"image": bytes(m.MAX_IMAGE_BYTES + 1)}),
    (
        m.ImageSimilarityRequest,
        "no negatives",
        {"query": m.SimilarityRequest("the image", negatives=("bed",))},
    ),
    (m.SimilarityRequest, "max_regions is 0", {"max_regions": 0}),
    (m.SimilarityRequest, "negative is empty", {"negatives": ("",)}),
    (m.SimilarityRequest, "11 negatives; between 0 and 10", {"negatives": ("bed",) * 11}),
    (m.SimilarityRequest, "give x_min, y_min", {"area_m": (0.0, 1.0)}),
    (m.SimilarityRequest, "give x_min, y_min", {"area_m": (0.0, 0.0, 1.0, NAN)}),
    (m.SimilarityRequest, "give x_min, y_min", {"area_m": (0.0, 0.0, 1.0, 1e6)}),
    (m.SimilarityRequest, "x_min < x_max", {"area_m": (1.0, 0.0, 1.0, 1.0)}),
    (m.SimilarityRequest, "robot_xy_m has 1 numbers", {"robot_xy_m": (1.0,)}),
    (m.SimilarityRequest, "robot_xy_m contains NaN", {"robot_xy_m": (1.0, INF)}),
    (m.SimilarityReply, "best_views has shape", {"best_views": f(2, 2)}),
    (m.SimilarityReply, "beyond the 2", {"outline_owner": np.array([0, 1, 2, 2], np.int32)}),
    (m.SearchViewRequest, "text is empty", {"text": "  "}),
    (m.ViewChangesRequest, "rival is empty", {"rivals": ("",)}),
    (m.ViewKey, "query has 401 characters", {"query": "1" * 401}),
    (m.ViewKey, "number is -1; it must be at least 0", {"number": -1}),
    (m.SearchView, "occupancy has shape", {"occupancy": SMALL}),
    (m.SearchView, "layers has shape", {"layers": SMALL}),
    (m.ViewChanges, "cells has shape", {"cells": u8(1, 500)}),
    (m.ViewChanges, "occupancy has shape", {"cells": u8(1, 512)}),
    (m.ViewChanges, "layers has shape", {"layers": u8(3)}),
    (m.ViewChanges, "values has 1 rows beside a likeness; expected 0, 2", {"values": f(1, 1)}),
    (m.ViewChanges, "values has shape", {"values": f(3, 2)}),
    (m.ViewChanges, "rank_limits has shape", {"rank_limits": f(0)}),
    (m.ViewChanges, "not of whole tiles", {"grid": GridSpec(0.1, (-60, 0), (128, 192))}),
    (m.ViewChanges, "outside of the grid's, 0 to 2", {"tiles": np.array([[0, 3]], np.int32)}),
    (
        m.ViewChanges,
        "there twice",
        {
            "tiles": np.zeros((2, 2), np.int32),
            "cells": np.pad(np.full((2, 1), 128, np.uint8), ((0, 0), (0, 511))),
        },
    ),
    (m.SavedMap, "no name", {"name": ""}),
    (m.SavedMap, "problem has 256 characters", {"problem": "x" * 256}),
    (m.MapMerge, "x_m is nan", {"x_m": NAN}),
    (m.CameraView, "height_m is nan", {"height_m": NAN}),
    (m.CameraView, "up_deg is 91", {"up_deg": 91.0}),
    (m.ObjectFind, "object name is empty", {"name": " "}),
    (m.ObjectFind, "extent_m contains NaN or infinity", {"extent_m": (0.0, 0.0, 0.0, INF)}),
    (m.ObjectFind, "box_px has 2 numbers; it needs 4, or none", {"box_px": (1.0, 2.0)}),
    (m.KeptObject, "must be nanoseconds since 1970", {"last_seen_ns": 2**63}),
    (m.KeptObject, "no id", {"object_id": ""}),
    (m.SearchRequest, "between 1 and 20", {"objects": ()}),
    (m.SearchRequest, "between 1 and 20", {"objects": ("sofa",) * 21}),
    (m.SearchRequest, "object name is empty", {"objects": ("sofa", " ")}),
    (m.SearchRequest, "patience_s is nan", {"patience_s": NAN}),
    (m.Odometry, "linear_mps contains NaN", {"linear_mps": NAN}),
    (m.Odometry, "angular_radps contains NaN", {"angular_radps": -INF}),
    (m.Odometry, "lateral_mps contains NaN", {"lateral_mps": INF}),
    (m.SearchRequest, "max_time_s is inf; it must be at least 0", {"max_time_s": INF}),
    (m.SearchRequest, "has only objects", {"place_m": (1.0, 2.0)}),
    (m.SearchRequest, "has only a place", {**PLACE, "place_m": (1.0, 2.0)}),
    (m.SearchRequest, "has 0 numbers", {**PLACE, "objects": ()}),
    (m.SearchStatus, "has 3 numbers", {**PLACE, "place_m": (1.0, 2.0, 3.0)}),
    (m.SearchStatus, "within 100000 m", {**PLACE, "place_m": (NAN, 0.0)}),
    (m.SearchStatus, "are their units metres", {**PLACE, "place_m": (1.1e5, 0.0)}),
    (m.SearchList, "listed twice", {"searches": (sample(m.SearchStatus),) * 2}),
    (m.PlannedPath, "points_m contains", {"points_m": f(1, 2, value=NAN)}),
    (m.PlannedPath, "motion is 'fly'", {"motion": "fly"}),
    (m.GoalChoice, "6 options; between 0 and 5", {"options": (sample(m.GoalOption),) * 6}),
]


@pytest.mark.parametrize(("cls", "reason", "changes"), IMPOSSIBLE)
def test_what_cannot_be_is_refused(cls: type[Any], reason: str, changes: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=reason):
        dataclasses.replace(sample(cls), **changes)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
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


@pytest.mark.parametrize("text", ["sofa", "  teddy\n bear ", "Kühlschrank", "冷蔵庫", "tv 2"])
def test_names_in_any_language_are_accepted_and_cleaned(text: str) -> None:
    assert m.check_text(text) == " ".join(text.split())
    for message, field in (
        (m.TextRequest((text,)), "texts"),
        (m.SearchRequest((text,)), "objects"),
        (m.SearchViewRequest("sofa", (text,)), "rivals"),
        (m.ViewChangesRequest("sofa", (text,)), "rivals"),
    ):
        assert getattr(message, field) == (m.check_text(text),)


def test_the_longest_lists_fit_into_one_message() -> None:
    text = "x" * m.MAX_FILE_TEXT_CHARS
    saved = m.SavedMap(text, 2**62, 2**62, text, text, 0.1, 2**62, 2**62, text)
    kept = dataclasses.replace(sample(m.KeptObject), name="\U00010348" * 200, search_id="s" * 64)
    for full in (
        m.MapList((saved,) * m.MAX_LISTED_MAPS, 9),
        m.ObjectList((kept,) * m.MAX_LISTED_OBJECTS),
    ):
        assert decode(type(full), encode(full)) == full


def test_a_status_has_its_target_while_active_and_a_drive_its_place() -> None:
    status = sample(m.SearchStatus)
    assert (status.active, status.target, status.subject) == (True, "bed", "'bed'")
    for state in m.FINAL_STATES:
        ended = dataclasses.replace(status, state=state)
        assert (ended.active, ended.target) == (False, "")
    drive = dataclasses.replace(
        status, objects=(), details=(), kind=m.SearchKind.GO_TO, place_m=(1.0, -2.5)
    )
    assert (drive.target, drive.subject) == ("", "the place (1.00, -2.50)")


def embeddings(rows: list[list[float]], competing: list[list[int]]) -> m.TextEmbeddings:
    """Embeddings of the texts a, b, c with these rows of ``neutral_mask``."""
    mask = np.array(competing, np.uint8).reshape(3, -1)
    neutral = np.zeros((mask.shape[1], 2), np.float32)
    return m.TextEmbeddings(
        "e", "s", ("a", "b", "c"), np.array(rows, np.float32), neutral, mask, 1.0
    )  # fmt: skip


@pytest.mark.parametrize(
    ("rows", "competing"),
    [
        ([[1, 0], [0, 1], [1, 0]], [[0, 1], [0, 1], [1, 1]]),  # a and b spare the same word
        ([[1, 0], [0.95, 0.31225], [0, 1]], [[], [], []]),  # without words, the cosine decides
    ],
)
def test_which_texts_mean_the_same(rows: list[list[float]], competing: list[list[int]]) -> None:
    expected = [[True, True, False], [True, True, False], [False, False, True]]
    assert embeddings(rows, competing).same_meaning().tolist() == expected


def encoded(width: int, height: int, suffix: str, *options: int) -> bytes:
    image = np.random.default_rng(0).integers(0, 255, (height, width, 3), dtype=np.uint8)
    data: bytes = cv2.imencode(suffix, image, options)[1].tobytes()
    return data


@pytest.mark.parametrize("size", [(16, 16), (320, 17), (33, 4096)])
@pytest.mark.parametrize(
    ("suffix", "options"),
    [(".png", ()), (".jpg", ()), (".jpg", (cv2.IMWRITE_JPEG_PROGRESSIVE, 1))],
)
def test_the_header_of_a_picture_says_its_size(
    size: tuple[int, int], suffix: str, options: tuple[int, ...]
) -> None:
    data = encoded(*size, suffix, *options)
    assert image_size_px(data) == size
    m.check_image(data)
    with pytest.raises(ValueError, match="no PNG and no JPEG"):
        m.check_image(data[:20])


def test_half_precision_is_finite_unless_its_bits_say_otherwise() -> None:
    every = np.arange(2**16, dtype=np.uint16).view(np.float16)
    finite(every[np.isfinite(every)], "features")
    for number in every[~np.isfinite(every)]:
        with pytest.raises(ValueError, match="features contains NaN or infinity"):
            finite(number, "features")


def test_segments_before_the_frame_of_a_jpeg_are_passed_over() -> None:
    data = encoded(40, 24, ".jpg")
    camera = b"\xff\xe1\x00\x06Exif" + b"\xff\xfe\x00\x04hi" + b"\xff"
    assert image_size_px(data[:2] + camera + data[2:]) == (40, 24)


@pytest.mark.parametrize("size", [(15, 40), (40, 1), (16, 4097)])
def test_too_small_and_too_large_pictures_are_refused(size: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match=f"has {size[0]} x {size[1]} pixels; each side must have"):
        m.check_image(encoded(*size, ".png"))


def test_a_small_file_that_claims_to_be_huge_is_refused() -> None:
    bomb = bytearray(encoded(40, 24, ".png"))
    bomb[16:24] = b"\x00\x01\x00\x00\x00\x01\x00\x00"
    with pytest.raises(ValueError, match="65536 x 65536 pixels"):
        m.check_image(bytes(bomb))


@given(st.binary(max_size=200))
def test_no_bytes_break_the_check(data: bytes) -> None:
    for start in (b"", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"):
        size = image_size_px(start + data)
        assert size is None or min(size) >= 0
