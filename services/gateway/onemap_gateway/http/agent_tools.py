"""The tools of an agent: the gateway's calls, each with its role and a reply in words."""
# Talks: draws in a thread.

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Any

from anyio import to_thread
from pydantic import ConfigDict, Field, ValidationError

from onemap.replies import MapObject, MapPose
from onemap_gateway.config import TOKENS, GatewayConfig, Role
from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.problems import HttpProblem, from_validation_errors
from onemap_gateway.http.queries import answer, robot_xy_m
from onemap_gateway.http.schemas import Limit, ObjectName, RequestModel
from onemap_gateway.present.agents import (
    AgentReply,
    AgentSearchReply,
    FoundObjectsReply,
    MapReply,
    PlacesReply,
    SeenObjectReply,
    found_objects_reply,
    map_reply,
    places_reply,
    progress_summary,
    seen_object_reply,
    started_summary,
    stopped_summary,
)
from onemap_gateway.present.live import build_overlay
from onemap_gateway.present.palette import PALETTES, Theme
from onemap_gateway.present.render import encode_png, render_map
from onemap_gateway.present.replies import map_object, map_statistics, search_snapshot
from onemap_shared import keys
from onemap_shared.geometry import yaw_of
from onemap_shared.messages import (
    MAX_OBJECTS,
    ObjectId,
    ObjectListRequest,
    SearchId,
    SearchKind,
    SearchOrder,
    SearchRequest,
    SimilarityRequest,
)


class NoArguments(RequestModel):
    """A tool that needs nothing."""

    model_config = ConfigDict(json_schema_extra={"examples": [{}]})


class PlacesArguments(RequestModel):
    """Where is it?"""

    model_config = ConfigDict(json_schema_extra={"examples": [{"object": "sofa"}]})

    object: ObjectName
    max_places: int = Field(default=5, ge=1, le=20, description="Likely places to return.")


class MapArguments(RequestModel):
    """What is known of the flat?"""

    model_config = ConfigDict(json_schema_extra={"examples": [{"picture": True}]})

    picture: bool = Field(default=False, description="Also return the map as an image.")


class SeenObjectArguments(RequestModel):
    """Which object to show."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"object": "bed"}]})

    object: ObjectName = Field(description="Its name, or its id as 'list_objects' gives it.")


class AgentSearchArguments(RequestModel):
    """What to find, and what that may cost at most."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"objects": ["sofa", "kettle"], "max_distance_m": 40, "max_time_s": 300}]
        }
    )

    objects: list[ObjectName] = Field(
        min_length=1, max_length=MAX_OBJECTS, description="What to find, in plain words."
    )
    max_distance_m: Limit = Field(description="Metres that the robot may drive for all of it.")
    max_time_s: Limit = Field(description="Seconds that all of it may take.")
    order: SearchOrder = Field(
        default=SearchOrder.GIVEN, description="Find them in this order, or in the cheapest."
    )


class WhichSearchArguments(RequestModel):
    """Which search is meant."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"search_id": ""}]})

    search_id: str = Field(
        default="", pattern=r"^[A-Za-z0-9_-]{0,64}$", description="Empty: the newest search."
    )


AGENT_S_PER_M = 9.0  # time of a search for each metre: it looks around more than it drives


@dataclass(frozen=True, slots=True)
class ToolResult:
    """What a tool returns: the reply, and perhaps a picture of ``media_type``."""

    reply: AgentReply
    picture: bytes = b""
    media_type: str = ""


@dataclass(frozen=True, slots=True)
class AgentTool:
    """A tool: its name and description, the role it needs, what it takes and returns.

    ``changes``: it starts or stops the robot.
    """

    name: str
    description: str
    role: Role
    arguments: type[RequestModel]
    reply: type[AgentReply]
    run: Callable[[GatewayContext, Any], Awaitable[ToolResult]]

    @property
    def changes(self) -> bool:
        return self.role > Role.LOOK


async def where_is(gateway: GatewayContext, asked: PlacesArguments) -> ToolResult:
    """Objects of that name that a search found, then regions that look like it."""
    request = SimilarityRequest(asked.object, asked.max_places, robot_xy_m=robot_xy_m(gateway))
    reply = await answer(gateway, request)
    found = tuple(kept for kept in await _found(gateway) if _is_called(kept, asked.object))
    return ToolResult(places_reply(reply, found))


async def list_objects(gateway: GatewayContext, _asked: NoArguments) -> ToolResult:
    """Everything that searches found on this map."""
    return ToolResult(found_objects_reply(await _found(gateway)))


async def describe_map(gateway: GatewayContext, asked: MapArguments) -> ToolResult:
    """The map in numbers, where the robot stands, and on request an image of both."""
    view, state = await gateway.view(), gateway.cache.state
    info = map_statistics(
        view, state.revision.message if state.revision else None, gateway.now_ns()
    )
    robot = None
    if state.odometry is not None:
        T_map_body = state.odometry.message.T_map_body
        x_m, y_m = T_map_body[:2, 3].tolist()
        robot = MapPose(x_m=x_m, y_m=y_m, yaw_rad=yaw_of(T_map_body))
    fault = gateway.fault()
    reply = map_reply(info, robot, fault.detail if fault else "")
    if not asked.picture:
        return ToolResult(reply)
    overlay = build_overlay(state, gateway.cache.now_s())
    drawn = await to_thread.run_sync(render_map, view, overlay, None, PALETTES[Theme.LIGHT])
    return ToolResult(reply, await to_thread.run_sync(encode_png, drawn.image), "image/png")


async def look_at(gateway: GatewayContext, asked: SeenObjectArguments) -> ToolResult:
    """A found object with the picture in which it was seen best."""
    found = await _found(gateway)
    for kept in found:
        if kept.id == asked.object or _is_called(kept, asked.object):
            seen = await gateway.call(keys.MAP_OBJECT, ObjectId(kept.id))
            reply = seen_object_reply(map_object(seen.kept))
            return ToolResult(reply, seen.picture, "image/jpeg")
    raise HttpProblem(
        "unknown_object",
        f"No search has found {asked.object!r} yet: 'list_objects' says what was found, "
        "'where_is' where it may be, and 'start_search' finds it.",
    )


async def start_search(gateway: GatewayContext, asked: AgentSearchArguments) -> ToolResult:
    """Send the robot to find objects within a budget."""
    _check_budget(gateway.config, asked)
    request = SearchRequest(
        tuple(asked.objects),
        gateway.paces.call_timeout_s,
        SearchKind.FIND,
        order=asked.order,
        max_distance_m=asked.max_distance_m,
        max_time_s=asked.max_time_s,
    )
    try:
        status = await gateway.call(keys.SEARCH_START, request)
    except HttpProblem as problem:
        if problem.code != "conflict":
            raise
        raise HttpProblem(
            "conflict",
            "The robot is busy with another search: wait until 'search_status' says that it has "
            "ended, or end it with 'stop'.",
        ) from None
    report = search_snapshot(status, gateway.now_ns())
    summary = started_summary(report, asked.max_distance_m, asked.max_time_s)
    return ToolResult(AgentSearchReply(summary=summary, search=report))


async def search_status(gateway: GatewayContext, asked: WhichSearchArguments) -> ToolResult:
    """How a search goes or ended."""
    try:
        status = await gateway.call(keys.SEARCH_GET, SearchId(asked.search_id))
    except HttpProblem as problem:
        return _no_search(asked, problem)
    report = search_snapshot(status, gateway.now_ns())
    return ToolResult(AgentSearchReply(summary=progress_summary(report), search=report))


async def stop(gateway: GatewayContext, asked: WhichSearchArguments) -> ToolResult:
    """Stop the robot and end the search."""
    before = gateway.cache.state.search
    try:
        status = await gateway.call(keys.SEARCH_CANCEL, SearchId(asked.search_id))
    except HttpProblem as problem:
        return _no_search(asked, problem)
    ended = {before.message.search_id} if before and not before.message.active else set()
    report = search_snapshot(status, gateway.now_ns())
    summary = stopped_summary(report, had_ended=status.search_id in ended)
    return ToolResult(AgentSearchReply(summary=summary, search=report))


def _no_search(asked: WhichSearchArguments, problem: HttpProblem) -> ToolResult:
    if problem.code != "unknown_search" or asked.search_id:
        raise problem
    summary = "There has been no search since the planner started: the robot does not drive by one."
    return ToolResult(AgentSearchReply(summary=summary, search=None))


def _check_budget(config: GatewayConfig, asked: AgentSearchArguments) -> None:
    for name, limit, unit in budget_limits(config):
        if getattr(asked, name) > limit:
            raise HttpProblem(
                "invalid",
                f"{name!r} is {getattr(asked, name):g}, and one search of an agent may take at "
                f"most {limit:g} {unit} ('gateway.agent_max_distance_m'): give less.",
            )


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


TOOLS: Mapping[str, AgentTool] = {
    tool.name: tool
    for tool in (
        AgentTool(
            "where_is",
            "Where is an object? Places that a search confirmed, then regions of the map that "
            "look like it, best first. Places are in metres of the map frame. Does not move the "
            "robot.",
            Role.LOOK,
            PlacesArguments,
            PlacesReply,
            where_is,
        ),
        AgentTool(
            "list_objects",
            "Every object that a search found on this map, the one found last first. Does not "
            "move the robot.",
            Role.LOOK,
            NoArguments,
            FoundObjectsReply,
            list_objects,
        ),
        AgentTool(
            "describe_map",
            "Size and age of the map, where the robot stands, and what is wrong if something is; "
            "with picture also an image of the map. Does not move the robot.",
            Role.LOOK,
            MapArguments,
            MapReply,
            describe_map,
        ),
        AgentTool(
            "look_at",
            "Show an object that was found: place, time and the picture in which the robot saw "
            "it best. Does not move the robot.",
            Role.LOOK,
            SeenObjectArguments,
            SeenObjectReply,
            look_at,
        ),
        AgentTool(
            "start_search",
            "MOVES THE ROBOT: explore until the objects are found or the budget of metres and "
            "seconds is spent. Returns at once; ask 'search_status' every few seconds. One search "
            "at a time.",
            Role.SEARCH,
            AgentSearchArguments,
            AgentSearchReply,
            start_search,
        ),
        AgentTool(
            "search_status",
            "How a search goes or how it ended, with what it found. Does not move the robot.",
            Role.LOOK,
            WhichSearchArguments,
            AgentSearchReply,
            search_status,
        ),
        AgentTool(
            "stop",
            "STOPS THE ROBOT and ends the search; what it found so far is kept.",
            Role.SEARCH,
            WhichSearchArguments,
            AgentSearchReply,
            stop,
        ),
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
        # the first part of a place is where FastAPI has found it
        errors = [{**found, "loc": ("body", *found["loc"])} for found in error.errors()]
        raise from_validation_errors(errors) from None
    return await tool.run(gateway, asked)
