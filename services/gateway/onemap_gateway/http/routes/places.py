"""Places: rooms with a name and zones that no robot enters."""
# Talks: outlines are drawn in threads.

from __future__ import annotations

from typing import Annotated

from anyio import to_thread
from fastapi import APIRouter, Path
from pydantic import AfterValidator

from onemap.place_replies import MapPlace, PlaceListReply
from onemap_gateway.http.context import GatewayContext, GatewayDep
from onemap_gateway.http.problems import HttpProblem, problem_responses
from onemap_gateway.http.schemas import HERE, PlaceRequest
from onemap_gateway.present.places import place_list
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.names import same_name

router = APIRouter(prefix="/v1", tags=["places"])


def check_place_name(name: str) -> str:
    """Return the name without needless spaces; ValueError if no place can have it."""
    return m.PlacesChange(forgotten=(name,)).forgotten[0]


def check_new_name(name: str) -> str:
    """As ``check_place_name``; ValueError also for a name that means something else."""
    return m.PlacesChange((m.Place(name, inside_m=HERE),)).named[0].name


IN_PATH = Path(description="Its case does not matter.", examples=["kitchen"])
Name = Annotated[str, AfterValidator(check_place_name), IN_PATH]
NewName = Annotated[str, AfterValidator(check_new_name), IN_PATH]


@router.get("/places", summary="Rooms and places", responses=problem_responses(503))
async def list_places(gateway: GatewayDep) -> PlaceListReply:
    """Named places, then names that are suggested by what was found in a room, then other rooms.

    A room is floor cut off at doors and narrow passages. Names are kept with the map: saved,
    loaded, merged and cleared with it, and kept when the mapper restarts.
    """
    return await to_thread.run_sync(place_list, await _places(gateway))


@router.put(
    "/places/{name:path}", summary="Name a place", responses=problem_responses(404, 422, 503, 507)
)
async def name_place(name: NewName, request: PlaceRequest, gateway: GatewayDep) -> MapPlace:
    """Name the room that holds a point, the room of the robot, or a polygon.

    A place that has the name is replaced. No robot enters a `keep_out` place from now on. One that
    cannot be written (507) changes nothing.
    """
    robot_m = gateway.robot_xy_m()
    if request.is_here and not robot_m:
        raise HttpProblem(
            "unavailable",
            "No pose of the robot has arrived yet: check the robot and its driver.",
            service="robot",
        )
    change = m.PlacesChange((request.place(name, robot_m),))
    return await _item(await gateway.call(keys.MAP_CHANGE_PLACES, change), name)


@router.delete(
    "/places/{name:path}", summary="Forget a place", responses=problem_responses(404, 422, 503, 507)
)
async def forget_place(name: Name, gateway: GatewayDep) -> MapPlace:
    """Remove a name or a zone, and say what it was; the map stays."""
    before = await _places(gateway)
    await gateway.call(keys.MAP_CHANGE_PLACES, m.PlacesChange(forgotten=(name,)))
    return await _item(before, name)


@router.delete("/places", summary="Forget all places", responses=problem_responses(503, 507))
async def forget_places(gateway: GatewayDep) -> PlaceListReply:
    """Remove all names and zones; the map stays.

    Places that cannot be read (503, `unreadable`) let no robot drive until a person says with this
    that there are none. Their file is kept on the mapper's machine.
    """
    changed = await gateway.call(keys.MAP_CHANGE_PLACES, m.PlacesChange(all_others=True))
    return await to_thread.run_sync(place_list, changed)


async def _places(gateway: GatewayContext) -> m.MapPlaces:
    return await gateway.call(keys.MAP_PLACES, m.PlacesRequest())


async def _item(message: m.MapPlaces, name: str) -> MapPlace:
    """The place of this name; it may have been forgotten meanwhile."""
    listed = await to_thread.run_sync(place_list, message)
    for place in listed.places:
        if same_name(place.name, name):
            return place
    raise HttpProblem("no_such_place", f"There is no place {name!r} any more.")
