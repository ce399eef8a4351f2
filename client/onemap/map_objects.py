"""What a robot has found, as its gateway lists it."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime, timezone
from urllib.parse import quote

from onemap.errors import InvalidSetting
from onemap.replies import Document

ADDRESS = "/v1/objects"


@dataclass(frozen=True, slots=True)
class MapObject:
    """An object that was found, kept with the map.

    position_m: x, y, z of its middle; extent_m: x_min, y_min, x_max, y_max; height_m: between which
    heights above the floor it lies, None if not known; score: 0 to 1;
    first_found_ns, last_seen_ns: nanoseconds since 1970, by the robot's clock; box_px: x0, y0,
    x1, y1 in the picture, None if not known; has_picture: whether ``Client.object_picture`` has
    one.
    """

    id: str
    name: str
    position_m: tuple[float, float, float]
    extent_m: tuple[float, float, float, float]
    height_m: tuple[float, float] | None
    score: float
    times_found: int
    search_id: str
    first_found_ns: int
    last_seen_ns: int
    box_px: tuple[float, float, float, float] | None
    has_picture: bool
    document: Document = field(repr=False, compare=False)

    @property
    def last_seen_at(self) -> datetime:
        """When its picture was taken, in UTC."""
        return datetime.fromtimestamp(self.last_seen_ns / 1e9, tz=timezone.utc)

    @classmethod
    def of(cls, document: Document) -> MapObject:
        """The object that ``document`` describes."""
        x_m, y_m, z_m = (float(value) for value in document["position_m"])
        x_min, y_min, x_max, y_max = (float(value) for value in document["extent_m"])
        box_px = None
        if document.get("box_px"):
            x0, y0, x1, y1 = (float(side) for side in document["box_px"])
            box_px = (x0, y0, x1, y1)
        height_m = None
        if document.get("height_m"):
            low_m, high_m = (float(value) for value in document["height_m"])
            height_m = (low_m, high_m)
        return cls(
            id=str(document["id"]),
            name=str(document["name"]),
            position_m=(x_m, y_m, z_m),
            extent_m=(x_min, y_min, x_max, y_max),
            height_m=height_m,
            score=float(document["score"]),
            times_found=int(document["times_found"]),
            search_id=str(document.get("search_id", "")),
            first_found_ns=int(document["first_found_ns"]),
            last_seen_ns=int(document["last_seen_ns"]),
            box_px=box_px,
            has_picture=bool(document.get("picture")),
            document=document,
        )


def object_path(object_id: str) -> str:
    """The address of an object; InvalidSetting if the id would lead to another one."""
    if not object_id or "/" in object_id or object_id.startswith("."):
        raise InvalidSetting(f"{object_id!r} is no id of an object: Client.objects() has them.")
    return f"{ADDRESS}/{quote(object_id, safe='')}"
