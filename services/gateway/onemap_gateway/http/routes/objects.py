"""What was found, and where."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Header, Path, Response
from starlette.convertors import StringConvertor, register_url_convertor

from onemap.replies import MapObject, ObjectListReply
from onemap_gateway.http.context import GatewayDep
from onemap_gateway.http.problems import HttpProblem, content, problem_responses
from onemap_gateway.present.replies import map_object
from onemap_shared import keys
from onemap_shared.messages import MAX_TEXT_CHARS, ObjectId, ObjectListRequest


class _ObjectIdConvertor(StringConvertor):
    regex = r"[^/]+(?<!\.jpg)"  # a picture can be neither asked for nor deleted as an object


register_url_convertor("object", _ObjectIdConvertor())
router = APIRouter(prefix="/v1/objects", tags=["objects"])


async def checked_object_id(
    object_id: Annotated[
        str, Path(description="The object's id, as in the list.", examples=["3f9a12c4"])
    ],
) -> ObjectId:
    """The id for the mapper; one that no object can have is not found."""
    try:
        return ObjectId(object_id)
    except ValueError:
        raise HttpProblem(
            "unknown_object", f"No object has the id {object_id[:MAX_TEXT_CHARS]!r}."
        ) from None


Id = Annotated[ObjectId, Depends(checked_object_id)]


@router.get("", summary="What was found?", responses=problem_responses(503))
async def list_objects(gateway: GatewayDep) -> ObjectListReply:
    """Every object that a search found on this map, the one found last first.

    They are kept with the map: saved, loaded and cleared with it, and kept when the mapper
    restarts. A find of the same name nearby is the same object found again.
    """
    listed = await gateway.call(keys.MAP_OBJECTS, ObjectListRequest())
    objects = tuple(map(map_object, listed.objects))
    return ObjectListReply(objects=objects, left_out=listed.left_out)


@router.get(
    "/{object_id}.jpg",
    summary="The picture in which it was seen",
    response_class=Response,
    responses={
        200: content(
            "image/jpeg",
            "The camera's image in which the object was seen best when it was last found, at most "
            "640 pixels on its longer side. `ETag` changes with the picture.",
            format="binary",
        ),
        304: {"description": "The picture is still the one of `If-None-Match`."},
        **problem_responses(404, 422, 503),
    },
)
async def get_object_picture(
    object_id: Id,
    gateway: GatewayDep,
    if_none_match: Annotated[str, Header(description="The `ETag` of an earlier reply.")] = "",
) -> Response:
    """The JPEG in which the object was last seen."""
    found = await gateway.call(keys.MAP_OBJECT, object_id)
    if not found.picture:
        raise HttpProblem(
            "unknown_object", f"There is no picture of the object {object_id.object_id!r}."
        )
    tag = f'"{object_id.object_id}-{found.kept.last_seen_ns}"'  # another picture, another tag
    headers = {"ETag": tag, "Cache-Control": "no-cache"}  # kept, and asked for again
    if tag in if_none_match:
        return Response(status_code=304, headers=headers)
    return Response(found.picture, media_type="image/jpeg", headers=headers)


@router.get(
    "/{object_id:object}", summary="A found object", responses=problem_responses(404, 422, 503)
)
async def get_object(object_id: Id, gateway: GatewayDep) -> MapObject:
    """Name, place, score and times of an object."""
    return map_object((await gateway.call(keys.MAP_OBJECT, object_id)).kept)


@router.delete(
    "/{object_id:object}",
    summary="Forget an object",
    responses=problem_responses(404, 422, 503),
)
async def forget_object(object_id: Id, gateway: GatewayDep) -> MapObject:
    """Remove an object that was found wrongly, and say what it was."""
    return map_object(await gateway.call(keys.MAP_FORGET, object_id))
