"""Checks that messages make when they are built: arrays, shares, texts and pictures.

No picture is decoded here, so that a small file that claims to be huge costs nothing.
"""

from __future__ import annotations

import numpy as np

MAX_TEXT_CHARS = 200  # of the name of one object
MAX_PICTURE_BYTES = 256 * 1024  # simulated frames of 640 x 480 take up to 42 kB
MAX_NAME_CHARS = 64  # of the name of a process, ours have 12, or of a world

# Metadata of a field that was added to a message: a sender that does not know it leaves it out,
# and the receiver takes the field's default.
ADDED = {"added": True}


def check_name(name: str, field: str) -> None:
    """Raise ValueError unless ``name`` can name a process or a world; empty stands for none."""
    if len(name) > MAX_NAME_CHARS or not name.isprintable():
        raise ValueError(
            f"{field} has {len(name)} characters; it must be a printable name with at most "
            f"{MAX_NAME_CHARS}"
        )


def expect(array: np.ndarray, name: str, dtype: type, shape: tuple[int | None, ...]) -> None:
    """Raise ValueError unless ``array`` has this dtype and shape (None is any length)."""
    if array.dtype != np.dtype(dtype):
        raise ValueError(f"{name} has dtype {array.dtype}; expected {np.dtype(dtype)}")
    fits = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits:
        wanted = tuple("any" if n is None else n for n in shape)
        raise ValueError(f"{name} has shape {array.shape}; expected {wanted}")


def expect_finite(array: np.ndarray, name: str) -> None:
    """Raise ValueError if any value is NaN or infinite."""
    if not np.isfinite(array).all():
        raise ValueError(f"{name} contains NaN or infinity")


def expect_share(value: float, name: str) -> None:
    """Raise ValueError unless 0 <= value <= 1; also refuses NaN."""
    if not 0.0 <= value <= 1.0:
        raise ValueError(f"{name} is {value}; it must lie in [0, 1]")


def check_picture(picture: bytes) -> None:
    """Raise ValueError if a picture is too large; empty stands for none."""
    if len(picture) > MAX_PICTURE_BYTES:
        raise ValueError(
            f"the picture has {len(picture)} bytes; the limit is {MAX_PICTURE_BYTES}: make it "
            "smaller or leave it out"
        )


def clean_texts(message: object, field: str, what: str = "text") -> None:
    """Replace a message's texts, one or a tuple, by what ``check_text`` returns for each.

    Called while the message is built, so that no instance has other texts.
    """
    value = getattr(message, field)
    if isinstance(value, tuple):
        object.__setattr__(message, field, tuple(check_text(text, what) for text in value))
    else:
        object.__setattr__(message, field, check_text(value, what))


def check_text(text: str, what: str = "text") -> str:
    """Return the text stripped and with single spaces, or raise ValueError with one sentence."""
    if not isinstance(text, str):
        raise ValueError(f"{what} must be a string, not {type(text).__name__}")
    cleaned = " ".join(text.split())
    if not cleaned:
        raise ValueError(f"{what} is empty: name an object, for example 'sofa'")
    if len(cleaned) > MAX_TEXT_CHARS:
        raise ValueError(
            f"{what} has {len(cleaned)} characters; the limit is {MAX_TEXT_CHARS}: "
            "name an object, for example 'sofa'"
        )
    if not any(character.isalpha() for character in cleaned) or not cleaned.isprintable():
        raise ValueError(f"{what} holds no readable word: name an object, for example 'sofa'")
    return cleaned


MAX_IMAGE_BYTES = 512 * 1024  # a JPEG of 1920 x 1080; a crop of one thing takes a tenth of that
MIN_IMAGE_SIDE_PX, MAX_IMAGE_SIDE_PX = 16, 4096  # two patches of the smallest encoder; a 4K camera
PNG, JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8"
NOT_FRAME_HEADERS = frozenset({0xC4, 0xC8, 0xCC})  # of the markers C0 to CF of a JPEG
WITHOUT_LENGTH = frozenset({0x01, *range(0xD0, 0xD8)})


def check_image(data: bytes) -> None:
    """Raise ValueError unless ``data`` begins as a PNG or JPEG of a size that is allowed."""
    if len(data) > MAX_IMAGE_BYTES:
        raise ValueError(
            f"the image has {len(data)} bytes; the limit is {MAX_IMAGE_BYTES}: send a smaller "
            "crop, or a JPEG"
        )
    size = image_size_px(data)
    if size is None:
        raise ValueError("the image is no PNG and no JPEG, or it is cut off: send one of these")
    if not MIN_IMAGE_SIDE_PX <= min(size) <= max(size) <= MAX_IMAGE_SIDE_PX:
        raise ValueError(
            f"the image has {size[0]} x {size[1]} pixels; each side must have "
            f"{MIN_IMAGE_SIDE_PX} to {MAX_IMAGE_SIDE_PX}: send a crop of one thing"
        )


def image_size_px(data: bytes) -> tuple[int, int] | None:
    """(width, height) as the header of a PNG or JPEG says; None if there is no such header."""
    if data.startswith(PNG):
        if data[12:16] != b"IHDR" or len(data) < 24:
            return None
        return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    return jpeg_size_px(data)


def jpeg_size_px(data: bytes) -> tuple[int, int] | None:
    """From the frame header: the first segment with a marker of C0 to CF that is none of others."""
    at = 2 if data.startswith(JPEG) else len(data)
    while at + 9 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if marker == 0xFF:  # padding
            at += 1
        elif marker in WITHOUT_LENGTH:
            at += 2
        elif 0xC0 <= marker <= 0xCF and marker not in NOT_FRAME_HEADERS:
            height, width = data[at + 5 : at + 7], data[at + 7 : at + 9]
            return int.from_bytes(width, "big"), int.from_bytes(height, "big")
        else:
            at += 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return None
