"""Messages about found objects, which the mapper keeps with the map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, TypeAlias

from onemap_shared.messages import checks

MAX_WHERE_CHARS = 120  # two names in words; longer ones are left out
MAX_LISTED_OBJECTS = 150  # in one message of 256 kB, with names of 200 characters in any script
Id: TypeAlias = Annotated[str, checks.chars(64)]
PositionM: TypeAlias = Annotated[tuple[float, float, float], checks.numbers(3)]
ExtentM: TypeAlias = Annotated[tuple[float, float, float, float], checks.numbers(4)]
BoxPx: TypeAlias = Annotated[tuple[float, ...], checks.numbers(4, optional=True)]
StampNs: TypeAlias = Annotated[int, checks.within(0, 2**63 - 1, rule="nanoseconds since 1970")]


@dataclass(frozen=True, slots=True)
class ObjectFind(checks.Message):
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

    name: checks.ObjectName
    position_m: PositionM
    extent_m: ExtentM
    score: checks.Share
    stamp_ns: StampNs
    search_id: Id
    box_px: BoxPx = ()
    picture: checks.Picture = b""


@dataclass(frozen=True, slots=True)
class KeptObject(checks.Message):
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
        robot: namespace of the robot that found it last; empty: it has none, or not known.
        where: as people say it, by room and landmark; empty: not known, and in files.
    """

    object_id: Id
    name: checks.ObjectName
    position_m: PositionM
    extent_m: ExtentM
    score: checks.Share
    times_found: checks.Count
    search_id: Id
    first_found_ns: StampNs
    last_seen_ns: StampNs
    box_px: BoxPx = ()
    picture_bytes: checks.Count = 0
    height_m: Annotated[tuple[float, ...], checks.numbers(2, optional=True)] = ()
    robot: str = ""
    where: Annotated[str, checks.chars(MAX_WHERE_CHARS)] = ""

    def _check(self) -> None:
        if not self.object_id:
            raise ValueError("a kept object has no id")


@dataclass(frozen=True, slots=True)
class ObjectId(checks.Message):
    """Names a kept object.

    Attributes:
        object_id: as in the list of objects.
    """

    object_id: Id


@dataclass(frozen=True, slots=True)
class PicturedObject(checks.Message):
    """A kept object with its picture.

    Attributes:
        kept: the object.
        picture: the JPEG in which it was last found; empty if there is none.
    """

    kept: KeptObject
    picture: checks.Picture


@dataclass(frozen=True, slots=True)
class ObjectListRequest:
    """Request for the objects that were found."""


@dataclass(frozen=True, slots=True)
class ObjectList(checks.Message):
    """The kept objects, the one found last first.

    Attributes:
        objects: without their pictures, at most 150.
        left_out: number of objects that were found earlier and are not kept any more, because
            newer ones took their place.
    """

    objects: Annotated[tuple[KeptObject, ...], checks.items(MAX_LISTED_OBJECTS)]
    left_out: checks.Count = 0
