"""Checks that messages make when they are built, declared with the types of their fields.

No picture is decoded here, so that a small file that claims to be huge costs nothing.
"""

from __future__ import annotations

import typing
from collections.abc import Callable
from dataclasses import field, fields
from enum import Enum
from functools import cache
from math import inf
from typing import Annotated, Any, TypeAlias

import numpy as np

from onemap_shared.geometry import F64, check_rigid

__all__ = [
    "MAX_IMAGE_BYTES",
    "MAX_IMAGE_SIDE_PX",
    "MAX_PICTURE_BYTES",
    "MAX_TEXT_CHARS",
    "MIN_IMAGE_SIDE_PX",
    "check_image",
    "check_text",
    "expect",
    "image_size_px",
    "jpeg_size_px",
]

MAX_TEXT_CHARS = 200  # of the name of one object
MAX_PICTURE_BYTES = 256 * 1024  # simulated frames of 640 x 480 take up to 42 kB
MAX_NAME_CHARS = 64  # of the name of a process, ours have 12, or of a world


class Word(str, Enum):
    """Base of enumerations whose members are words on the wire, and printed as these."""

    def __str__(self) -> str:
        return str(self.value)


# Raises ValueError for a value of the field of this name, or returns what to keep instead of it;
# None: the value itself.
Check: TypeAlias = Callable[[Any, str], Any]


class Message:
    """Base of messages with checked fields: those that their types name with ``Annotated``."""

    __slots__ = ()

    def __post_init__(self) -> None:
        message: Any = type(self)
        lengths: dict[str, int] = {}
        for name, dtype, checks in _declared(message):
            for check in checks:
                value = getattr(self, name)
                if isinstance(check, Shape):
                    check.compare(value, name, dtype, lengths)
                elif (kept := check(value, name)) is not None:
                    object.__setattr__(self, name, kept)
        self._check()

    def _check(self) -> None:
        """Raise ValueError for fields that do not fit each other."""


@cache
def _declared(message: type) -> tuple[tuple[str, Any, tuple[Any, ...]], ...]:
    """The checked fields of a message: name, dtype of an array, checks in their order."""
    hints = typing.get_type_hints(message, include_extras=True)
    checked = []
    for name in (each.name for each in fields(message)):
        if checks := getattr(hints[name], "__metadata__", ()):
            kind = typing.get_args(hints[name])[0]
            is_array = typing.get_origin(kind) is np.ndarray
            dtype = typing.get_args(typing.get_args(kind)[1])[0] if is_array else None
            checked.append((name, dtype, checks))
    return tuple(checked)


class Shape:
    """Shape of an array with the dtype of its type: numbers, or letters for the same length in
    all fields of a message, or None for any. Of a tuple: how many entries it has."""

    def __init__(self, *lengths: int | str | None) -> None:
        self.lengths = lengths

    def compare(self, value: Any, name: str, dtype: Any, known: dict[str, int]) -> None:
        """Raise ValueError unless it fits, and add the lengths that are ``known`` from now on."""
        wanted = [known.get(each) if isinstance(each, str) else each for each in self.lengths]
        if isinstance(value, np.ndarray):
            expect(value, name, dtype, tuple(wanted))
            have = value.shape
        else:
            have = (len(value),)
        known.update({k: n for k, n in zip(self.lengths, have, strict=True) if isinstance(k, str)})


def without(dtype: type, *shape: int) -> Any:
    """The field of an array that is not there unless it is given: zeros of this shape."""
    return field(default_factory=lambda: np.zeros(shape, dtype))


def expect(array: np.ndarray, name: str, dtype: Any, shape: tuple[int | None, ...]) -> None:
    """Raise ValueError unless ``array`` has this dtype and shape (None is any length)."""
    if array.dtype != np.dtype(dtype):
        raise ValueError(f"{name} has dtype {array.dtype}; expected {np.dtype(dtype)}")
    fits = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits:
        wanted = tuple("any" if n is None else n for n in shape)
        raise ValueError(f"{name} has shape {array.shape}; expected {wanted}")


FLOAT16_EXPONENT = np.uint16(0x7C00)  # all ones: infinity or NaN


def finite(numbers: Any, name: str) -> None:
    """Raise ValueError if any of an array, or the one number, is NaN or infinite."""
    known = np.asarray(numbers)
    if known.dtype == np.float16:  # by its bits: numpy converts each, 9 times as slow
        is_finite = (known.view(np.uint16) & FLOAT16_EXPONENT) != FLOAT16_EXPONENT
    else:
        is_finite = np.isfinite(known)
    if not is_finite.all():
        raise ValueError(f"{name} contains NaN or infinity")


def rigid(T: F64, name: str) -> None:
    """Raise ValueError unless ``T`` (4, 4) is a rigid transform."""
    check_rigid(T, name)


def printable(name: str, field: str) -> None:
    """Raise ValueError unless ``name`` can name a process or a world; empty stands for none."""
    if len(name) > MAX_NAME_CHARS or not name.isprintable():
        raise ValueError(
            f"{field} has {len(name)} characters; it must be a printable name with at most "
            f"{MAX_NAME_CHARS}"
        )


def within(low: float, high: float = inf, *, above: bool = False, rule: str = "") -> Check:
    """A number from ``low`` (itself only unless ``above``) to ``high``; no infinity, no NaN.

    rule: what it must be, where the limits alone do not say it.
    """

    def check(value: float, name: str) -> None:
        low_enough = low < value if above else low <= value
        if not (low_enough and value <= high and value < inf):
            limits = f"{'above' if above else 'at least'} {low:g}"
            limits += f", at most {high:g}" if high < inf else ""
            raise ValueError(f"{name} is {value}; it must be {rule or limits}")

    return check


def chars(limit: int) -> Check:
    """A text of at most so many characters."""

    def check(text: str, name: str) -> None:
        if len(text) > limit:
            raise ValueError(f"{name} has {len(text)} characters; the limit is {limit}")

    return check


def items(most: int, *, least: int = 0) -> Check:
    """A tuple of ``least`` to ``most`` entries."""

    def check(values: tuple[Any, ...], name: str) -> None:
        if not least <= len(values) <= most:
            raise ValueError(f"{len(values)} {name}; between {least} and {most} are allowed")

    return check


def numbers(count: int, *, optional: bool = False) -> Check:
    """A tuple of ``count`` finite numbers; of none as well, if ``optional``."""

    def check(values: tuple[float, ...], name: str) -> None:
        if len(values) != count and (values or not optional):
            none = ", or none" if optional else ""
            raise ValueError(f"{name} has {len(values)} numbers; it needs {count}{none}")
        finite(values, name)

    return check


ADVICE = "name an object, for example 'sofa'"


def cleaned(what: str = "text", *, optional: bool = False, advice: str = ADVICE) -> Check:
    """A text, or each of a tuple, as ``check_text`` cleans it; empty as well if ``optional``."""

    def check(value: Any, _: str) -> Any:
        if isinstance(value, tuple):
            return tuple(check_text(text, what, advice) for text in value)
        return value if optional and value == "" else check_text(value, what, advice)

    return check


def check_text(text: str, what: str = "text", advice: str = ADVICE) -> str:
    """Return the text stripped and with single spaces, or raise ValueError with one sentence.

    what: the text is; advice: what to do about a wrong one.
    """
    plain = " ".join(text.split())
    if not plain:
        raise ValueError(f"{what} is empty: {advice}")
    if len(plain) > MAX_TEXT_CHARS:
        raise ValueError(
            f"{what} has {len(plain)} characters; the limit is {MAX_TEXT_CHARS}: {advice}"
        )
    if not any(character.isalpha() for character in plain) or not plain.isprintable():
        raise ValueError(f"{what} holds no readable word: {advice}")
    return plain


def check_picture(picture: bytes, _: str) -> None:
    """Raise ValueError if a picture is too large; empty stands for none."""
    if len(picture) > MAX_PICTURE_BYTES:
        raise ValueError(
            f"the picture has {len(picture)} bytes; the limit is {MAX_PICTURE_BYTES}: make it "
            "smaller or leave it out"
        )


MAX_IMAGE_BYTES = 512 * 1024  # a JPEG of 1920 x 1080; a crop of one thing takes a tenth of that
MIN_IMAGE_SIDE_PX, MAX_IMAGE_SIDE_PX = 16, 4096  # two patches of the smallest encoder; a 4K camera
PNG, JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8"
NOT_FRAME_HEADERS = frozenset({0xC4, 0xC8, 0xCC})  # of the markers C0 to CF of a JPEG
WITHOUT_LENGTH = frozenset({0x01, *range(0xD0, 0xD8)})


def check_image(data: bytes, _: str = "") -> None:
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


Pose: TypeAlias = Annotated[F64, rigid]
Name: TypeAlias = Annotated[str, printable]
ObjectName: TypeAlias = Annotated[str, cleaned("object name")]
Picture: TypeAlias = Annotated[bytes, check_picture]
Image: TypeAlias = Annotated[bytes, check_image]
Finite: TypeAlias = Annotated[float, finite]
Share: TypeAlias = Annotated[float, within(0, 1)]
Count: TypeAlias = Annotated[int, within(0)]
