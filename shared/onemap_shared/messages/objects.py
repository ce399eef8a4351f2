"""Messages about found objects, which the mapper keeps with the map."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from onemap_shared.messages.checks import ADDED, check_picture, clean_texts, expect_share

MAX_LISTED_OBJECTS = 150  # in one message of 256 kB, with names of 200 characters in any script
MAX_ID_CHARS = 64


@dataclass(frozen=True, slots=True)
class ObjectFind:
    """An object that a search has just confirmed, for the mapper to keep.

    Attributes:
        name: as it was searched for.
        position_m: x, y, z of its middle in the map frame.
        extent_m: x_min, y_min, x_max, y_max of the cells that it was seen on.
        score: similarity of the map where it was found, in [0, 1].
        stamp_ns: capture time of the picture, in nanoseconds of the robot's wall clock.
        box_px: x0, y0, x1, y1 of the object in pixels of the picture; empty: not known.
        picture: a JPEG in which the object was detected; may be empty.
    """

    name: str
    position_m: tuple[float, float, float]
    extent_m: tuple[float, float, float, float]
    score: float
    stamp_ns: int
    search_id: str
    box_px: tuple[float, ...] = ()
    picture: bytes = b""

    def __post_init__(self) -> None:
        _check_place(self)
        check_picture(self.picture)


@dataclass(frozen=True, slots=True)
class KeptObject:
    """A found object as the mapper keeps it, without its picture.

    Attributes:
        object_id: names the object, as long as it is kept.
        name: as it was searched for when it was last found.
        position_m: x, y, z of its middle in the map frame.
        extent_m: x_min, y_min, x_max, y_max of the cells that it was seen on.
        score: similarity of the map where it was last found, in [0, 1].
        times_found: how many searches confirmed it.
        search_id: of the newest of them.
        first_found_ns: capture time of its first picture, on the robot's wall clock.
        last_seen_ns: capture time of its present picture, on the robot's wall clock.
        box_px: x0, y0, x1, y1 of the object in pixels of the picture; empty: not known.
        picture_bytes: size of the picture, 0 if there is none.
        height_m: between which heights above the floor it lies; empty: not known.
    """

    object_id: str
    name: str
    position_m: tuple[float, float, float]
    extent_m: tuple[float, float, float, float]
    score: float
    times_found: int
    search_id: str
    first_found_ns: int
    last_seen_ns: int
    box_px: tuple[float, ...] = ()
    picture_bytes: int = 0
    height_m: tuple[float, ...] = field(default=(), metadata=ADDED)

    def __post_init__(self) -> None:
        _check_place(self)
        _check_id(self.object_id, "object_id")
        if not self.object_id:
            raise ValueError("a kept object has no id")
        for field_name in ("times_found", "picture_bytes"):
            value = getattr(self, field_name)
            if value < 0:
                raise ValueError(f"{field_name} is {value}; it must not be negative")
        _check_numbers(self.height_m, "height_m")
        if len(self.height_m) not in (0, 2):
            raise ValueError(f"height_m has {len(self.height_m)} numbers; it needs 2, or none")


@dataclass(frozen=True, slots=True)
class ObjectId:
    """Names a kept object.

    Attributes:
        object_id: as in the list of objects.
    """

    object_id: str

    def __post_init__(self) -> None:
        _check_id(self.object_id, "object_id")


@dataclass(frozen=True, slots=True)
class PicturedObject:
    """A kept object with its picture.

    Attributes:
        kept: the object.
        picture: the JPEG in which it was last found; empty if there is none.
    """

    kept: KeptObject
    picture: bytes

    def __post_init__(self) -> None:
        check_picture(self.picture)


@dataclass(frozen=True, slots=True)
class ObjectListRequest:
    """Request for the objects that were found."""


@dataclass(frozen=True, slots=True)
class ObjectList:
    """The kept objects, the one found last first.

    Attributes:
        objects: without their pictures, at most 150.
        left_out: number of objects that were found earlier and are not kept any more, because
            others took their room.
    """

    objects: tuple[KeptObject, ...]
    left_out: int = 0

    def __post_init__(self) -> None:
        if len(self.objects) > MAX_LISTED_OBJECTS:
            raise ValueError(
                f"{len(self.objects)} objects; at most {MAX_LISTED_OBJECTS} are listed"
            )
        if self.left_out < 0:
            raise ValueError(f"left_out is {self.left_out}; it must not be negative")


def _check_place(message: ObjectFind | KeptObject) -> None:
    """Check what a find and a kept object have in common; cleans the name."""
    clean_texts(message, "name", "object name")
    expect_share(message.score, "score")
    _check_id(message.search_id, "search_id")
    _check_numbers(message.position_m, "position_m")
    _check_numbers(message.extent_m, "extent_m")
    _check_numbers(message.box_px, "box_px")
    if len(message.box_px) not in (0, 4):
        raise ValueError(f"box_px has {len(message.box_px)} numbers; it needs 4, or none")
    for field_name in ("stamp_ns", "first_found_ns", "last_seen_ns"):
        stamp_ns = getattr(message, field_name, 0)
        if not 0 <= stamp_ns < 2**63:
            raise ValueError(f"{field_name} is {stamp_ns}; it must be nanoseconds since 1970")


def _check_numbers(values: Iterable[float], name: str) -> None:
    if not all(map(math.isfinite, values)):
        raise ValueError(f"{name} contains NaN or infinity")


def _check_id(text: str, name: str) -> None:
    if len(text) > MAX_ID_CHARS:
        raise ValueError(f"{name} has {len(text)} characters; the limit is {MAX_ID_CHARS}")
