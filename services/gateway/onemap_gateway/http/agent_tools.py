"""The tools of an agent: the gateway's calls, each with its role and a reply in words.

A reply has a sentence that says what is so or was done, and the numbers. The docstring of a tool is
its description for agents.
"""
# Talks: draws in a thread.

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from inspect import signature
from typing import Annotated, Any

from anyio import to_thread
from pydantic import BaseModel, Field, ValidationError, create_model

from onemap.place_replies import MapPlace
from onemap.replies import (
    LookedArea,
    MapObject,
    MapPose,
    MapStatistics,
    Region,
    SearchSnapshot,
    rfc3339,
)
from onemap_gateway.bus.live_state import newest
from onemap_gateway.config import TOKENS, GatewayConfig, Role
from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.problems import HttpProblem, from_validation_error
from onemap_gateway.http.routes.queries import answers
from onemap_gateway.http.routes.searches import start
from onemap_gateway.http.schemas import (
    DescribedObject,
    Limit,
    ObjectName,
    QueryRequest,
    RequestModel,
    SearchStart,
)
from onemap_gateway.present.live import build_overlay
from onemap_gateway.present.palette import PALETTES, Theme
from onemap_gateway.present.places import place_list
from onemap_gateway.present.render import encode_png, render_map
from onemap_gateway.present.replies import map_object, map_statistics
from onemap_gateway.present.service_status import sentence
from onemap_shared import keys
from onemap_shared.messages import (
    MAX_OBJECTS,
    NO_DETAIL,
    ObjectId,
    ObjectListRequest,
    PlaceKind,
    PlacesRequest,
    SearchId,
    SearchState,
    Verdict,
)

AGENT_S_PER_M = 9.0  # time of a search for each metre: it looks around more than it drives


class AgentReply(BaseModel):
    """The reply of a tool."""

    summary: str = Field(description="The reply in words.")


class PlacesReply(AgentReply):
    """Where something is, or may be."""

    found: tuple[MapObject, ...] = Field(description="Of this name, confirmed by a search.")
    likely: tuple[Region, ...] = Field(description="Regions that look like it, not confirmed.")
    map_age_s: float | None = Field(description="Age of the newest frame in the map.")
    verdict: Verdict = Field(
        description="By the map alone: found, not_here or not_looked_yet (search for it)."
    )
    looked: LookedArea


class FoundObjectsReply(AgentReply):
    """The objects that searches found, the one found last first."""

    objects: tuple[MapObject, ...]


class NamedPlacesReply(AgentReply):
    """Rooms with a name and zones that no robot enters, then suggested names."""

    places: tuple[MapPlace, ...]


class MapReply(AgentReply):
    """The map, the robot on it, and whether they work."""

    ready: bool = Field(description="Whether frames reach the map and all services are there.")
    problem: str = Field(description="The reason why not; empty if all is well.")
    map: MapStatistics
    robot: MapPose | None = Field(description="null: no pose yet.")


class SeenObjectReply(AgentReply):
    """A found object; its picture is beside this reply."""

    object: MapObject


class AgentSearchReply(AgentReply):
    """A search; the summary says what the call did."""

    search: SearchSnapshot | None = Field(description="null: there has been none.")


@dataclass(frozen=True, slots=True)
class ToolResult:
    """What a tool returns: the reply, and perhaps a picture of ``media_type``."""

    reply: AgentReply
    picture: bytes = b""
    media_type: str = ""


class AgentTool:
    """A tool: the role it needs, what it returns, and the function that is called.

    The parameters of the function are the tool's arguments, its docstring is the description.
    """

    def __init__(
        self, role: Role, reply: type[AgentReply], run: Callable[..., Awaitable[ToolResult]]
    ) -> None:
        self.role, self.reply, self.run = role, reply, run
        self.name = run.__name__
        self.description = " ".join((run.__doc__ or "").split())
        self.changes = role > Role.LOOK  # it starts or stops the robot
        _, *taken = signature(run, eval_str=True).parameters.values()
        fields: dict[str, Any] = {
            each.name: (each.annotation, ... if each.default is each.empty else each.default)
            for each in taken
        }
        self.arguments = create_model(self.name, __base__=RequestModel, **fields)


SoughtObject = Annotated[
    DescribedObject,
    Field(
        description="A plain noun as 'lamp', or an object with that noun as 'text' and what else "
        "is known of it in the parts: for 'the lamp beside the bed, not in the nursery' give "
        "{'text': 'lamp', 'near': 'bed', 'not_in': 'nursery'}. Leave out what is not said."
    ),
]
WhichSearch = Annotated[
    str, Field(pattern=r"^[A-Za-z0-9_-]{0,64}$", description="Empty: the newest search.")
]


async def where_is(
    gateway: GatewayContext,
    object: SoughtObject,
    max_places: Annotated[int, Field(ge=1, le=20, description="Likely places to return.")] = 5,
) -> ToolResult:
    """Where is an object? Places that a search confirmed, then regions of the map that look like
    it, best first. Places are in metres of the map frame. Does not move the robot.
    """
    asked = QueryRequest.model_validate({"texts": [object], "max_regions": max_places})
    (reply,) = await answers(gateway, asked)
    named = object.sentence()
    # a search that was told more of it may have confirmed another one
    plain = named.detail == NO_DETAIL
    found = tuple(kept for kept in await _found(gateway) if plain and _is_called(kept, named.name))
    parts = [] if plain and not reply.stands_for else [f"Understood as: {reply.understood}."]
    parts += [f"{_place(kept)} was found there by a search." for kept in found]
    if reply.regions:
        best = reply.regions[0]
        parts.append(
            f"{len(reply.regions)} regions of the map look like {reply.text!r}, the best at "
            f"{_xy(best.centre_m)}; no search confirmed that."
        )
    elif reply.message:
        parts += [reply.message, reply.sentence]
    return ToolResult(
        PlacesReply(
            summary=" ".join(parts),
            found=found,
            likely=reply.regions,
            map_age_s=reply.age_s,
            verdict=Verdict(reply.verdict),
            looked=reply.looked,
        )
    )


async def list_objects(gateway: GatewayContext) -> ToolResult:
    """Every object that a search found on this map, the one found last first. Does not move the
    robot.
    """
    objects = await _found(gateway)
    summary = "No search has found anything on this map yet."
    if objects:
        summary = f"Found so far: {', '.join(map(_place, objects))}."
    return ToolResult(FoundObjectsReply(summary=summary, objects=objects))


async def list_places(gateway: GatewayContext) -> ToolResult:
    """The rooms with a name, and the zones that no robot enters. A suggested name is a guess from
    what was found there. Does not move the robot.
    """
    message = await gateway.call(keys.MAP_PLACES, PlacesRequest())
    listed = await to_thread.run_sync(place_list, message)
    places = tuple(place for place in listed.places if place.name)
    said = "; ".join(map(_described, places))
    summary = f"Places: {said}." if places else "No place of this map has a name yet."
    return ToolResult(NamedPlacesReply(summary=summary, places=places))


async def describe_map(
    gateway: GatewayContext,
    picture: Annotated[bool, Field(description="Also return the map as an image.")] = False,
) -> ToolResult:
    """Size and age of the map, where the robot stands, and what is wrong if something is; with
    picture also an image of the map. Does not move the robot.
    """
    view, state = await gateway.view(), gateway.cache.state
    info = map_statistics(view, newest(state.revision), gateway.now_ns())
    robot, stands = None, "no pose of the robot is known"
    if state.robot is not None:
        x_m, y_m, yaw_rad = state.robot
        robot = MapPose(x_m=x_m, y_m=y_m, yaw_rad=yaw_rad)
        stands = f"the robot stands at {_xy((x_m, y_m))}"
    fault = gateway.fault()
    problem = fault.detail if fault else ""
    summary = (
        f"The map shows {info.free_m2:.1f} m2 of free floor and {info.occupied_m2:.1f} m2 of "
        f"obstacles from {info.frames_fused} frames; {stands}. {problem}"
    )
    reply = MapReply(
        summary=summary.rstrip(), ready=not problem, problem=problem, map=info, robot=robot
    )
    if not picture:
        return ToolResult(reply)
    overlay = build_overlay(state, gateway.cache.now_s())
    drawn = await to_thread.run_sync(render_map, view, overlay, None, PALETTES[Theme.LIGHT])
    return ToolResult(reply, await to_thread.run_sync(encode_png, drawn.image), "image/png")


async def look_at(
    gateway: GatewayContext,
    object: Annotated[
        ObjectName, Field(description="Its name, or its id as 'list_objects' gives it.")
    ],
) -> ToolResult:
    """Show an object that was found: place, time and the picture in which the robot saw it best.
    Does not move the robot.
    """
    for kept in await _found(gateway):
        if kept.id == object or _is_called(kept, object):
            pictured = await gateway.call(keys.MAP_OBJECT, ObjectId(kept.id))
            seen = map_object(pictured.kept)
            picture = "the picture is from then" if seen.picture else "there is no picture of it"
            said = f"{_place(seen)} was last seen at {rfc3339(seen.last_seen_at)}; {picture}."
            reply = SeenObjectReply(summary=said, object=seen)
            return ToolResult(reply, pictured.picture, "image/jpeg")
    raise HttpProblem(
        "unknown_object",
        f"No search has found {object!r} yet: 'list_objects' says what was found, "
        "'where_is' where it may be, and 'start_search' finds it.",
    )


async def start_search(
    gateway: GatewayContext,
    objects: Annotated[
        list[SoughtObject],
        Field(min_length=1, max_length=MAX_OBJECTS, description="What to find, in this order."),
    ],
    max_distance_m: Annotated[
        Limit, Field(description="Metres that the robot may drive for all of it.")
    ],
    max_time_s: Annotated[Limit, Field(description="Seconds that all of it may take.")],
) -> ToolResult:
    """MOVES THE ROBOT: explore until the objects are found or the budget of metres and seconds is
    spent. Returns at once; ask 'search_status' every few seconds. One search at a time.
    """
    given = {"max_distance_m": max_distance_m, "max_time_s": max_time_s}
    for name, limit, unit in budget_limits(gateway.config):
        if given[name] > limit:
            raise HttpProblem(
                "invalid",
                f"{name!r} is {given[name]:g}, and one search of an agent may take at most "
                f"{limit:g} {unit} ('gateway.agent_max_distance_m'): give less.",
            )
    asked = SearchStart(objects=objects, max_distance_m=max_distance_m, max_time_s=max_time_s)
    try:
        search = await start(gateway, asked)
    except HttpProblem as problem:
        if problem.code != "conflict":
            raise
        raise HttpProblem(
            "conflict",
            "The robot is busy with another search: wait until 'search_status' says that it has "
            "ended, or end it with 'stop'.",
        ) from None
    in_order = " in this order" if len(objects) > 1 else ""
    summary = (
        f"Started the search {search.id} for {_subject(search)}{in_order}: the robot drives now, "
        f"at most {max_distance_m:g} m and {max_time_s:g} s. 'search_status' says how it goes, "
        f"'stop' ends it. Understood as: {search.understood}."
    )
    return ToolResult(AgentSearchReply(summary=summary, search=search))


async def search_status(gateway: GatewayContext, search_id: WhichSearch = "") -> ToolResult:
    """How a search goes or how it ended, with what it found. Does not move the robot."""
    try:
        search = await gateway.search(keys.SEARCH_GET, SearchId(search_id))
    except HttpProblem as problem:
        return _no_search(search_id, problem)
    summary = (
        f"The search {search.id} for {_subject(search)} is {search.state} after {_spent(search)}: "
        f"{sentence(search.reason)}{_found_names(search)}"
    )
    return ToolResult(AgentSearchReply(summary=summary, search=search))


async def stop(gateway: GatewayContext, search_id: WhichSearch = "") -> ToolResult:
    """STOPS THE ROBOT and ends the search; what it found so far is kept."""
    before = newest(gateway.cache.state.search)
    try:
        search = await gateway.search(keys.SEARCH_CANCEL, SearchId(search_id))
    except HttpProblem as problem:
        return _no_search(search_id, problem)
    had_ended = before is not None and before.search_id == search.id and not before.active
    if had_ended or search.state != SearchState.CANCELLED:
        summary = (
            f"The search {search.id} for {_subject(search)} had ended before as {search.state}: "
            "there was nothing to stop."
        )
    else:
        summary = (
            f"Stopped the search {search.id} for {_subject(search)} after {_spent(search)}: the "
            f"robot brakes and stands.{_found_names(search)}"
        )
    return ToolResult(AgentSearchReply(summary=summary, search=search))


def _no_search(search_id: str, problem: HttpProblem) -> ToolResult:
    if problem.code != "unknown_search" or search_id:
        raise problem
    summary = "There has been no search since the planner started: the robot does not drive by one."
    return ToolResult(AgentSearchReply(summary=summary, search=None))


def budget_limits(config: GatewayConfig) -> tuple[tuple[str, float, str], ...]:
    """Argument, highest value and unit of each limit of an agent's search."""
    return (
        ("max_distance_m", config.agent_max_distance_m, "m"),
        ("max_time_s", config.agent_max_distance_m * AGENT_S_PER_M, "s"),
    )


async def _found(gateway: GatewayContext) -> tuple[MapObject, ...]:
    listed = await gateway.call(keys.MAP_OBJECTS, ObjectListRequest())
    return tuple(map(map_object, listed.objects))


def _is_called(kept: MapObject, name: str) -> bool:
    return kept.name.casefold() == name.casefold()


def _subject(search: SearchSnapshot) -> str:
    return f"the place {_xy(search.place_m)}" if search.place_m else _names(search.objects)


def _spent(search: SearchSnapshot) -> str:
    return f"{search.elapsed_s:.0f} s and {search.path_length_m:.1f} m"


def _found_names(search: SearchSnapshot) -> str:
    names = [result.name for result in search.results if result.found]
    return f" Found: {_names(names)}." if names else ""


def _place(kept: MapObject) -> str:
    return f"{kept.name!r} ({kept.id}) at {_xy(kept.position_m)}"


def _described(place: MapPlace) -> str:
    kind = "no robot enters it" if place.kind == PlaceKind.KEEP_OUT else ""
    notes = [kind, "suggested" if place.suggested else "", f"{place.area_m2:.1f} m2"]
    where = _xy(place.inside_m or place.corners_m[0])
    return f"{place.name!r} at {where} ({', '.join(filter(None, notes))})"


def _xy(place_m: Sequence[float]) -> str:
    return f"x {place_m[0]:.2f} m, y {place_m[1]:.2f} m"


def _names(names: Sequence[str]) -> str:
    return ", ".join(map(repr, names))


TOOLS: Mapping[str, AgentTool] = {
    tool.name: tool
    for tool in (
        AgentTool(Role.LOOK, PlacesReply, where_is),
        AgentTool(Role.LOOK, FoundObjectsReply, list_objects),
        AgentTool(Role.LOOK, NamedPlacesReply, list_places),
        AgentTool(Role.LOOK, MapReply, describe_map),
        AgentTool(Role.LOOK, SeenObjectReply, look_at),
        AgentTool(Role.SEARCH, AgentSearchReply, start_search),
        AgentTool(Role.LOOK, AgentSearchReply, search_status),
        AgentTool(Role.SEARCH, AgentSearchReply, stop),
    )
}


async def call_tool(
    gateway: GatewayContext, role: Role, name: str, arguments: Mapping[str, Any]
) -> ToolResult:
    """The result of a tool for a client of this role; raises ``HttpProblem`` with the reason."""
    tool = TOOLS.get(name)
    if tool is None:
        raise HttpProblem(
            "not_found", f"There is no tool {name[:60]!r}: there are {', '.join(TOOLS)}."
        )
    if role < tool.role:
        raise HttpProblem(
            "forbidden",
            f"This token may only look, and {name!r} moves or stops the robot: use that of "
            f"'gateway.{TOKENS[tool.role]}' or of a higher role.",
        )
    try:
        asked = tool.arguments.model_validate(arguments)
    except ValidationError as error:
        raise from_validation_error(error) from None
    return await tool.run(gateway, **dict(asked))
