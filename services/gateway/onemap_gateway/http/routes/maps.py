"""Saved maps: listed, described, saved, loaded, deleted."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response
from pydantic import AfterValidator

from onemap_gateway.http.context import GatewayDep
from onemap_gateway.http.problem_docs import BODY, problem_responses
from onemap_gateway.http.schemas import MAP_NAME, MapName, MergeRequest, check_map_name
from onemap_gateway.present.replies import MapChange, MapListReply, SavedMapReport
from onemap_gateway.present.views import map_change, map_list, saved_map_report
from onemap_shared import keys
from onemap_shared.messages import MapFile, MapListRequest, MapMerge

router = APIRouter(prefix="/v1", tags=["maps"])

NO_MOTION = MergeRequest()
FILE_S = 20.0  # a map of hundreds of megabytes on the card of a Jetson

Name = Annotated[
    str,
    AfterValidator(check_map_name),
    Path(
        description="Begins with a letter or a digit; letters A-Z and a-z, digits, '.', '_' and "
        "'-', at most 64; no folder.",
        json_schema_extra={"pattern": f"^{MAP_NAME.pattern}$"},
        examples=["flat"],
    ),
]


@router.get("/maps", summary="What was saved?", responses=problem_responses(503))
async def list_maps(gateway: GatewayDep) -> MapListReply:
    """The maps in the mapper's map folder, newest first; damaged ones say why."""
    return map_list(await gateway.call(keys.MAP_LIST, MapListRequest()))


@router.get("/maps/{name}", summary="A saved map", responses=problem_responses(404, 422, 503))
async def get_saved_map(name: Name, gateway: GatewayDep) -> SavedMapReport:
    """Size, encoder and time of a saved map, without its cells."""
    (saved,) = (await gateway.call(keys.MAP_LIST, MapListRequest(name))).maps
    return saved_map_report(saved)


@router.put(
    "/maps/{name}",
    summary="Save the map",
    responses={
        201: {
            "model": MapChange,
            "description": "No map had this name.",
            "headers": {"Location": {"schema": {"type": "string"}}},
        },
        **problem_responses(401, 409, 422, 503, 507),
    },
)
async def put_map(name: Name, gateway: GatewayDep, response: Response) -> MapChange:
    """Write the map to a file in the mapper's map folder; an older one is replaced."""
    summary = await gateway.call(keys.MAP_SAVE, MapFile(name), FILE_S)
    if summary.created:
        response.status_code = 201
        response.headers["Location"] = f"/v1/maps/{name}"
    return map_change(summary)


@router.delete(
    "/maps/{name}",
    summary="Delete a saved map",
    responses=problem_responses(401, 404, 422, 503, 507),
)
async def delete_map(name: Name, gateway: GatewayDep) -> SavedMapReport:
    """Delete a file of the mapper's map folder and say what it was; the map in use stays."""
    return saved_map_report(await gateway.call(keys.MAP_DELETE, MapFile(name)))


@router.post(
    "/maps/{name}/load",
    summary="Load a saved map",
    responses=problem_responses(401, 404, 409, 422, 503),
)
async def load_saved_map(name: Name, gateway: GatewayDep) -> MapChange:
    """Replace the map by a saved one; refused if another encoder made it."""
    return map_change(await gateway.call(keys.MAP_LOAD, MapFile(name), FILE_S))


@router.post(
    "/maps/{name}/merge",
    summary="Merge a saved map into the map in use",
    responses=problem_responses(*BODY, 401, 404, 409, 422, 503),
)
async def merge_saved_map(
    name: Name, gateway: GatewayDep, request: MergeRequest = NO_MOTION
) -> MapChange:
    """Fuse a saved map of the same frame, or of one that lies in it as the body says.

    Features are weighted by the inverse of their variance, so that it does not matter which of both
    maps came first; found objects that are none of ours are added. Refused if another encoder made
    it.
    """
    merge = MapMerge(name, request.x_m, request.y_m, request.yaw_rad)
    return map_change(await gateway.call(keys.MAP_MERGE, merge, FILE_S))


@router.post(
    "/map/save",
    deprecated=True,
    summary="Save the map",
    responses=problem_responses(*BODY, 401, 409, 422, 503, 507),
)
async def save_map(request: MapName, gateway: GatewayDep) -> MapChange:
    """As `PUT /v1/maps/{name}`, which replaces it: the next release does not have this address."""
    return map_change(await gateway.call(keys.MAP_SAVE, MapFile(request.name), FILE_S))


@router.post(
    "/map/load",
    deprecated=True,
    summary="Load a map",
    responses=problem_responses(*BODY, 401, 404, 409, 422, 503),
)
async def load_map(request: MapName, gateway: GatewayDep) -> MapChange:
    """As `POST /v1/maps/{name}/load`, which replaces it: the next release does not have this
    address.
    """
    return map_change(await gateway.call(keys.MAP_LOAD, MapFile(request.name), FILE_S))
