"""The tools of an agent: the gateway's calls, each with its role and a reply in words.

A reply has a sentence that says what is so or was done, and the numbers. The docstring of a tool is
its description for agents.
"""
# Talks: draws in a thread.

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from anyio import to_thread
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from onemap.replies import (
    LookedArea,
    MapObject,
    MapPose,
    MapStatistics,
    Region,
    SearchSnapshot,
    rfc3339,
)
from onemap_gateway.config import TOKENS, GatewayConfig, Role
from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.problems import HttpProblem, from_validation_errors
from onemap_gateway.http.queries import answer, robot_xy_m
from onemap_gateway.http.schemas import Limit, ObjectName, RequestModel
from onemap_gateway.present.live import build_overlay
from onemap_gateway.present.palette import PALETTES, Theme
from onemap_gateway.present.render import encode_png, render_map
from onemap_gateway.present.replies import map_object, map_statistics, search_snapshot
from onemap_gateway.present.service_status import sentence
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
    SearchState,
    SimilarityRequest,
    Verdict,
)

AGENT_S_PER_M = 9.0  # time of a search for each metre: it looks around more than it drives


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


class AgentReply(BaseModel):
    """The reply of a tool."""

    summary: str = Field(description="The reply in words.")


class PlacesReply(AgentReply):
    """Where something is, or may be."""

    found: tuple[MapObject, ...] = Field(description="Of this name, confirmed by a search.")
    likely: tuple[Region, ...] = Field(description="Regions that look like it, not confirmed.")
    did_you_mean: tuple[str, ...] = Field(
        description="The nearest known words, if there are no regions."
    )
    map_age_s: float | None = Field(description="Age of the newest frame in the map.")
    verdict: Verdict = Field(
        description="By the map alone: found, not_here or not_looked_yet (search for it)."
    )
    looked: LookedArea


class FoundObjectsReply(AgentReply):
    """The objects that searches found, the one found last first."""

    objects: tuple[MapObject, ...]


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


@dataclass(frozen=True, slots=True)
class AgentTool:
    """A tool: the role it needs, what it takes and returns."""

    role: Role
    arguments: type[RequestModel]
    reply: type[AgentReply]
    run: Callable[[GatewayContext, Any], Awaitable[ToolResult]]

    @property
    def name(self) -> str:
        return self.run.__name__

    @property
    def description(self) -> str:
        return " ".join((self.run.__doc__ or "").split())

    @property
    def changes(self) -> bool:
        """Whether it starts or stops the robot."""
        return self.role > Role.LOOK


async def where_is(gateway: GatewayContext, asked: PlacesArguments) -> ToolResult:
    """Where is an object? Places that a search confirmed, then regions of the map that look like
    it, best first. Places are in metres of the map frame. Does not move the robot.
    """
    request = SimilarityRequest(asked.object, asked.max_places, robot_xy_m=robot_xy_m(gateway))
    reply = await answer(gateway, request)
    found = tuple(kept for kept in await _found(gateway) if _is_called(kept, asked.object))
    parts = [f"{_place(kept)} was found there by a search." for kept in found]
    if reply.regions:
        best = reply.regions[0]
        parts.append(
            f"{len(reply.regions)} regions of the map look like {reply.text!r}, the best at "
            f"{_xy(best.centre_m)} with the score {best.score:.2f}; no search confirmed that."
        )
    elif reply.message:
        parts += [reply.message, reply.sentence]
    return ToolResult(
        PlacesReply(
            summary=" ".join(parts),
            found=found,
            likely=reply.regions,
            did_you_mean=reply.did_you_mean,
            map_age_s=reply.age_s,
            verdict=Verdict(reply.verdict),
            looked=reply.looked,
        )
    )


async def list_objects(gateway: GatewayContext, _asked: NoArguments) -> ToolResult:
    """Every object that a search found on this map, the one found last first. Does not move the
    robot.
    """
    objects = await _found(gateway)
    summary = "No search has found anything on this map yet."
    if objects:
        summary = f"Found so far: {', '.join(map(_place, objects))}."
    return ToolResult(FoundObjectsReply(summary=summary, objects=objects))


async def describe_map(gateway: GatewayContext, asked: MapArguments) -> ToolResult:
    """Size and age of the map, where the robot stands, and what is wrong if something is; with
    picture also an image of the map. Does not move the robot.
    """
    view, state = await gateway.view(), gateway.cache.state
    revision = state.revision.message if state.revision else None
    info = map_statistics(view, revision, gateway.now_ns())
    robot, stands = None, "no pose of the robot is known"
    if state.odometry is not None:
        T_map_body = state.odometry.message.T_map_body
        x_m, y_m = T_map_body[:2, 3].tolist()
        robot = MapPose(x_m=x_m, y_m=y_m, yaw_rad=yaw_of(T_map_body))
        stands = f"the robot stands at {_xy((robot.x_m, robot.y_m))}"
    fault = gateway.fault()
    problem = fault.detail if fault else ""
    summary = (
        f"The map shows {info.free_m2:.1f} m2 of free floor and {info.occupied_m2:.1f} m2 of "
        f"obstacles from {info.frames_fused} frames; {stands}. {problem}"
    )
    reply = MapReply(
        summary=summary.rstrip(), ready=not problem, problem=problem, map=info, robot=robot
    )
    if not asked.picture:
        return ToolResult(reply)
    overlay = build_overlay(state, gateway.cache.now_s())
    drawn = await to_thread.run_sync(render_map, view, overlay, None, PALETTES[Theme.LIGHT])
    return ToolResult(reply, await to_thread.run_sync(encode_png, drawn.image), "image/png")


async def look_at(gateway: GatewayContext, asked: SeenObjectArguments) -> ToolResult:
    """Show an object that was found: place, time and the picture in which the robot saw it best.
    Does not move the robot.
    """
    for kept in await _found(gateway):
        if kept.id == asked.object or _is_called(kept, asked.object):
            pictured = await gateway.call(keys.MAP_OBJECT, ObjectId(kept.id))
            seen = map_object(pictured.kept)
            picture = "the picture is from then" if seen.picture else "there is no picture of it"
            said = f"{_place(seen)} was last seen at {rfc3339(seen.last_seen_at)}; {picture}."
            reply = SeenObjectReply(summary=said, object=seen)
            return ToolResult(reply, pictured.picture, "image/jpeg")
    raise HttpProblem(
        "unknown_object",
        f"No search has found {asked.object!r} yet: 'list_objects' says what was found, "
        "'where_is' where it may be, and 'start_search' finds it.",
    )


async def start_search(gateway: GatewayContext, asked: AgentSearchArguments) -> ToolResult:
    """MOVES THE ROBOT: explore until the objects are found or the budget of metres and seconds is
    spent. Returns at once; ask 'search_status' every few seconds. One search at a time.
    """
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
    search = search_snapshot(status, gateway.now_ns())
    summary = started_summary(search, asked.max_distance_m, asked.max_time_s)
    return ToolResult(AgentSearchReply(summary=summary, search=search))


async def search_status(gateway: GatewayContext, asked: WhichSearchArguments) -> ToolResult:
    """How a search goes or how it ended, with what it found. Does not move the robot."""
    try:
        status = await gateway.call(keys.SEARCH_GET, SearchId(asked.search_id))
    except HttpProblem as problem:
        return _no_search(asked, problem)
    search = search_snapshot(status, gateway.now_ns())
    summary = (
        f"The search {search.id} for {_subject(search)} is {search.state} after {_spent(search)}: "
        f"{sentence(search.reason)}{_found_names(search)}"
    )
    return ToolResult(AgentSearchReply(summary=summary, search=search))


async def stop(gateway: GatewayContext, asked: WhichSearchArguments) -> ToolResult:
    """STOPS THE ROBOT and ends the search; what it found so far is kept."""
    before = gateway.cache.state.search
    try:
        status = await gateway.call(keys.SEARCH_CANCEL, SearchId(asked.search_id))
    except HttpProblem as problem:
        return _no_search(asked, problem)
    ended = {before.message.search_id} if before and not before.message.active else set()
    search = search_snapshot(status, gateway.now_ns())
    summary = stopped_summary(search, had_ended=status.search_id in ended)
    return ToolResult(AgentSearchReply(summary=summary, search=search))


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


def started_summary(search: SearchSnapshot, max_distance_m: float, max_time_s: float) -> str:
    """What starting a search did."""
    order = "in the cheapest order" if search.order == SearchOrder.ANY else "in this order"
    order = f" {order}" if len(search.objects) > 1 else ""
    return (
        f"Started the search {search.id} for {_subject(search)}{order}: the robot drives now, at "
        f"most {max_distance_m:g} m and {max_time_s:g} s. 'search_status' says how it goes, "
        "'stop' ends it."
    )


def stopped_summary(search: SearchSnapshot, *, had_ended: bool) -> str:
    """What stopping a search did; ``had_ended``: it was over before."""
    if had_ended or search.state != SearchState.CANCELLED:
        return (
            f"The search {search.id} for {_subject(search)} had ended before as {search.state}: "
            "there was nothing to stop."
        )
    return (
        f"Stopped the search {search.id} for {_subject(search)} after {_spent(search)}: the robot "
        f"brakes and stands.{_found_names(search)}"
    )


def _subject(search: SearchSnapshot) -> str:
    return f"the place {_xy(search.place_m)}" if search.place_m else _names(search.objects)


def _spent(search: SearchSnapshot) -> str:
    return f"{search.elapsed_s:.0f} s and {search.path_length_m:.1f} m"


def _found_names(search: SearchSnapshot) -> str:
    names = [result.name for result in search.results if result.found]
    return f" Found: {_names(names)}." if names else ""


def _place(kept: MapObject) -> str:
    return f"{kept.name!r} ({kept.id}) at {_xy(kept.position_m)}"


def _xy(place_m: Sequence[float]) -> str:
    return f"x {place_m[0]:.2f} m, y {place_m[1]:.2f} m"


def _names(names: Sequence[str]) -> str:
    return ", ".join(map(repr, names))


TOOLS: Mapping[str, AgentTool] = {
    tool.name: tool
    for tool in (
        AgentTool(Role.LOOK, PlacesArguments, PlacesReply, where_is),
        AgentTool(Role.LOOK, NoArguments, FoundObjectsReply, list_objects),
        AgentTool(Role.LOOK, MapArguments, MapReply, describe_map),
        AgentTool(Role.LOOK, SeenObjectArguments, SeenObjectReply, look_at),
        AgentTool(Role.SEARCH, AgentSearchArguments, AgentSearchReply, start_search),
        AgentTool(Role.LOOK, WhichSearchArguments, AgentSearchReply, search_status),
        AgentTool(Role.SEARCH, WhichSearchArguments, AgentSearchReply, stop),
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
