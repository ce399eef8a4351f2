"""Found objects as clients get them."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from onemap_gateway.present.formats import millimetres, rfc3339
from onemap_gateway.present.replies import Nanoseconds, Time
from onemap_shared.messages import KeptObject, ObjectList

ADDRESS = "/v1/objects"


class MapObjectReport(BaseModel):
    """An object that was found, kept with the map."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "id": "3f9a12c4",
                    "name": "bed",
                    "position_m": [3.42, -1.15, 0.41],
                    "extent_m": [2.5, -2.1, 4.4, -0.3],
                    "height_m": [0.1, 0.7],
                    "score": 0.93,
                    "times_found": 2,
                    "search_id": "8f14e45f",
                    "first_found_at": "2026-01-01T00:00:12.400Z",
                    "first_found_ns": "1767225612400000000",
                    "last_seen_at": "2026-01-01T00:09:51.000Z",
                    "last_seen_ns": "1767226191000000000",
                    "box_px": [120.0, 184.5, 512.0, 402.0],
                    "picture": "/v1/objects/3f9a12c4.jpg",
                }
            ]
        }
    )

    id: str
    name: str = Field(description="As it was searched for when it was last found.")
    position_m: tuple[float, float, float] = Field(
        description="x, y, z of its middle in the map frame, metres."
    )
    extent_m: tuple[float, float, float, float] = Field(
        description="x_min, y_min, x_max, y_max of the cells that it was seen on, metres."
    )
    height_m: tuple[float, float] | None = Field(
        description="Between which heights above the floor it lies, such as on a table or under "
        "it; null: not known."
    )
    score: float = Field(description="Similarity of the map where it was found, 0 to 1.")
    times_found: int = Field(description="How many searches found it there.")
    search_id: str = Field(description="The newest of these searches.")
    first_found_at: Time
    first_found_ns: Nanoseconds
    last_seen_at: Time = Field(description="When the picture was taken, by the robot's clock.")
    last_seen_ns: Nanoseconds
    box_px: tuple[float, float, float, float] | None = Field(
        description="x0, y0, x1, y1 of the object in pixels of the picture; null: not known."
    )
    picture: str | None = Field(
        description="Address of the JPEG in which it was seen best; null: there is none."
    )


class ObjectListReply(BaseModel):
    """The objects that were found, the one found last first."""

    objects: list[MapObjectReport]
    left_out: int = Field(
        description="Objects that are not kept any more, because others took their room."
    )


def object_report(kept: KeptObject) -> MapObjectReport:
    """A kept object."""
    return MapObjectReport(
        id=kept.object_id,
        name=kept.name,
        position_m=millimetres(kept.position_m),
        extent_m=millimetres(kept.extent_m),
        height_m=millimetres(kept.height_m) or None,
        score=kept.score,
        times_found=kept.times_found,
        search_id=kept.search_id,
        first_found_at=rfc3339(kept.first_found_ns),
        first_found_ns=str(kept.first_found_ns),
        last_seen_at=rfc3339(kept.last_seen_ns),
        last_seen_ns=str(kept.last_seen_ns),
        box_px=_box_px(kept.box_px),
        picture=f"{ADDRESS}/{kept.object_id}.jpg" if kept.picture_bytes else None,
    )


def object_list(listed: ObjectList) -> ObjectListReply:
    """The kept objects, the one found last first."""
    return ObjectListReply(
        objects=[object_report(kept) for kept in listed.objects], left_out=listed.left_out
    )


def picture_tag(kept: KeptObject) -> str:
    """The entity tag of an object's picture: another picture has another one."""
    return f'"{kept.object_id}-{kept.last_seen_ns}"'


def _box_px(sides: tuple[float, ...]) -> tuple[float, float, float, float] | None:
    if not sides:
        return None
    x0, y0, x1, y1 = (round(side, 1) for side in sides)
    return x0, y0, x1, y1
