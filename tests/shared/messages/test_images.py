"""Pictures as queries: the header says kind and size, before anything is decoded."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_shared.messages import (
    MAX_IMAGE_BYTES,
    ImageRequest,
    ImageSimilarityRequest,
    SimilarityRequest,
)
from onemap_shared.messages.checks import check_image, image_size_px
from tests.shared.messages.broken import assert_refused


def encoded(width: int, height: int, suffix: str, *options: int) -> bytes:
    image = np.random.default_rng(0).integers(0, 255, (height, width, 3), dtype=np.uint8)
    data: bytes = cv2.imencode(suffix, image, options)[1].tobytes()
    return data


@pytest.mark.parametrize("size", [(16, 16), (320, 17), (33, 4096)])
@pytest.mark.parametrize(
    ("suffix", "options"),
    [(".png", ()), (".jpg", ()), (".jpg", (cv2.IMWRITE_JPEG_PROGRESSIVE, 1))],
)
def test_the_size_is_that_of_the_image(
    size: tuple[int, int], suffix: str, options: tuple[int, ...]
) -> None:
    data = encoded(*size, suffix, *options)
    assert image_size_px(data) == size
    check_image(data)


def test_segments_before_the_frame_of_a_jpeg_are_passed_over() -> None:
    data = encoded(40, 24, ".jpg")
    camera = b"\xff\xe1\x00\x06Exif" + b"\xff\xfe\x00\x04hi" + b"\xff"
    assert image_size_px(data[:2] + camera + data[2:]) == (40, 24)


@pytest.mark.parametrize(
    "data",
    [b"", b"GIF89a\x20\x00\x20\x00", b"a text", b"\xff\xd8", b"\xff\xd8\xff\xe0\x00\x10JFIF"],
)
def test_what_is_no_png_or_jpeg_is_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match="no PNG and no JPEG"):
        check_image(data)


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
def test_a_header_that_is_cut_off_is_refused(suffix: str) -> None:
    with pytest.raises(ValueError, match="no PNG and no JPEG"):
        check_image(encoded(40, 24, suffix)[:20])


@pytest.mark.parametrize("size", [(15, 40), (40, 1), (16, 4097)])
def test_too_small_and_too_large_images_are_refused(size: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match=f"has {size[0]} x {size[1]} pixels; each side must have"):
        check_image(encoded(*size, ".png"))


def test_a_small_file_that_claims_to_be_huge_is_refused() -> None:
    bomb = bytearray(encoded(40, 24, ".png"))
    bomb[16:24] = b"\x00\x01\x00\x00\x00\x01\x00\x00"
    with pytest.raises(ValueError, match="65536 x 65536 pixels"):
        check_image(bytes(bomb))


@given(st.binary(max_size=200))
def test_no_bytes_break_the_check(data: bytes) -> None:
    for start in (b"", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"):
        size = image_size_px(start + data)
        assert size is None or min(size) >= 0


def test_messages_hold_only_images() -> None:
    for message in (ImageRequest, ImageSimilarityRequest):
        assert_refused(message, "no PNG", image=b"sofa")
        assert_refused(message, "the limit is 524288", image=bytes(MAX_IMAGE_BYTES + 1))


def test_texts_do_not_compete_with_an_image() -> None:
    query = SimilarityRequest("the image", negatives=("bed",))
    assert_refused(ImageSimilarityRequest, "no negatives", query=query)
