"""The tools of an agent, over the Model Context Protocol with its official SDK.

A tool is a function: its docstring is the description, its parameters are the arguments, and it
returns a sentence that says what is so or was done, with the reply of the HTTP interface.
Stateless: each request is complete in itself, so that a gateway that was restarted answers the
same agent without a new handshake.
"""
# Talks: draws in a thread, and logs what agents did.

from __future__ import annotations

import base64
import logging
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from inspect import signature
from typing import Annotated, Any, Generic, TypeVar, get_args

from anyio import to_thread
from mcp import types
from mcp.server.context import ServerRequestContext
from mcp.server.lowlevel import Server
from mcp.server.streamable_http_manager import StreamableHTTPSessionManager
from pydantic import ConfigDict, Field, ValidationError, create_model
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from onemap import place_replies, replies, search_replies
from onemap_gateway.bus.live_state import newest
from onemap_gateway.config import TOKENS, GatewayConfig, Role
from onemap_gateway.http import schemas
from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.problems import HttpProblem, from_validation_error
from onemap_gateway.http.routes.queries import answers
from onemap_gateway.http.routes.searches import start
from onemap_gateway.http.security import replayed
from onemap_gateway.present.formats import finite, json_text
from onemap_gateway.present.live import build_overlay
from onemap_gateway.present.palette import PALETTES, Theme
from onemap_gateway.present.places import place_list
from onemap_gateway.present.render import encode_png, render_map
from onemap_gateway.present.replies import map_object, map_statistics, reply_of
from onemap_gateway.present.service_status import sentence
from onemap_shared import keys
from onemap_shared import messages as m

LOG = logging.getLogger("onemap.gateway")
logging.getLogger("mcp").setLevel(logging.WARNING)  # it reports the start and end of each request

AGENT_S_PER_M = 9.0  # time of a search for each metre: it looks around more than it drives
INSTRUCTIONS = (
    "A robot that knows where things are. Ask 'where_is' and 'list_objects' first. Only "
    "'start_search' and 'go_to' move the robot: give them a budget, tell people before you use "
    "them, and follow them with 'search_status'. Places are x, y in metres of the map frame."
)
R = TypeVar("R", bound=replies.Reply)


@dataclass(frozen=True, slots=True)
class Answer(Generic[R]):
    """What a tool returns; picture: a PNG or JPEG, empty without one."""

    summary: str
    reply: R
    picture: bytes = b""


@dataclass(frozen=True, slots=True)
class AgentTool:
    """A tool, the least role that may call it, and the models of its arguments and its reply."""

    run: Callable[..., Awaitable[Answer[Any]]]
    role: Role
    arguments: type[schemas.RequestModel]
    reply: type[replies.Reply]

    def described(self, config: GatewayConfig) -> types.Tool:
        """The tool as agents see it, with the limits of this gateway in its schema."""
        takes = self.arguments.model_json_schema()
        for name, limit, _unit in budget_limits(config):
            if name in takes.get("properties", {}):
                takes["properties"][name]["maximum"] = limit
        looks = self.role is Role.LOOK
        return types.Tool(
            name=self.run.__name__,
            description=" ".join((self.run.__doc__ or "").split()),
            input_schema=takes,
            output_schema=self.reply.model_json_schema(mode="serialization"),
            annotations=types.ToolAnnotations(
                read_only_hint=looks, destructive_hint=False, open_world_hint=False
            ),
        )


TOOLS: dict[str, AgentTool] = {}
Run = TypeVar("Run", bound=Callable[..., Awaitable[Answer[Any]]])


def tool(role: Role) -> Callable[[Run], Run]:
    """Register a function as a tool for clients of this role, and of higher ones."""

    def register(run: Run) -> Run:
        typed = signature(run, eval_str=True)
        _gateway, *parameters = typed.parameters.values()
        fields: dict[str, Any] = {
            each.name: (each.annotation, ... if each.default is each.empty else each.default)
            for each in parameters
        }
        arguments = create_model(run.__name__, __base__=schemas.RequestModel, **fields)
        (reply,) = get_args(typed.return_annotation)
        TOOLS[run.__name__] = AgentTool(run, role, arguments, reply)
        return run

    return register


class PlacesReply(replies.QueryResult):
    """Where something is, or may be."""

    model_config = ConfigDict(json_schema_extra={})  # the examples lack a member

    confirmed: tuple[replies.MapObject, ...] = Field(
        description="Objects of this name that a search found."
    )


class MapReply(replies.MapStatistics):
    """The map, the robot on it, and whether they work."""

    ready: bool = Field(description="Whether frames reach the map and all services are there.")
    problem: str = Field(description="The reason why not; empty if all is well.")
    robot: replies.MapPose | None = Field(description="null: no pose yet.")


SoughtObject = Annotated[
    schemas.DescribedObject,
    Field(
        description="A plain noun as 'lamp', or an object with that noun as 'text' and what else "
        "is known of it in the parts: for 'the lamp beside the bed, not in the nursery' give "
        "{'text': 'lamp', 'near': 'bed', 'not_in': 'nursery'}. Leave out what is not said."
    ),
]
Distance = Annotated[
    schemas.Limit, Field(description="Metres that the robot may drive for all of it.")
]
Time = Annotated[schemas.Limit, Field(description="Seconds that all of it may take.")]
WhichSearch = Annotated[
    str, Field(pattern=r"^[A-Za-z0-9_-]{0,64}$", description="Empty: the newest search.")
]


@tool(Role.LOOK)
async def where_is(
    gateway: GatewayContext,
    object: SoughtObject,
    max_places: Annotated[int, Field(ge=1, le=20, description="Likely places to return.")] = 5,
) -> Answer[PlacesReply]:
    """Where is an object? Places that a search confirmed, then regions of the map that look like
    it, best first. Places are in metres of the map frame. Does not move the robot.
    """
    request = schemas.QueryRequest.model_validate({"texts": [object], "max_regions": max_places})
    (reply,) = await answers(gateway, request)
    named = object.sentence()
    # a search that was told more of it may have confirmed another one
    plain = named.detail == m.NO_DETAIL
    objects = await _found(gateway) if plain else ()
    confirmed = tuple(item for item in objects if _is_called(item, named.name))
    parts = [f"Understood as: {reply.understood}."]
    parts += [f"{_place(item)} was found there by a search." for item in confirmed]
    parts += [reply.sentence, *([reply.message] if reply.message else [])]
    if reply.regions and not confirmed:
        parts.append("The map looks like it there; no search confirmed it.")
    return Answer(" ".join(parts), reply_of(PlacesReply, reply, confirmed=confirmed))


@tool(Role.LOOK)
async def list_objects(gateway: GatewayContext) -> Answer[replies.ObjectListReply]:
    """Every object that a search found on this map, the one found last first. Does not move the
    robot.
    """
    objects = await _found(gateway)
    summary = "No search has found anything on this map yet."
    if objects:
        summary = f"Found so far: {', '.join(map(_place, objects))}."
    return Answer(summary, replies.ObjectListReply(objects=objects))


@tool(Role.LOOK)
async def list_places(gateway: GatewayContext) -> Answer[place_replies.PlaceListReply]:
    """The rooms with a name, and the zones that no robot enters. A suggested name is a guess from
    what was found there. Does not move the robot.
    """
    message = await gateway.call(keys.MAP_PLACES, m.PlacesRequest())
    listed = await to_thread.run_sync(place_list, message)
    places = tuple(place for place in listed.places if place.name)
    summary = "No place of this map has a name yet."
    if places:
        summary = f"Places: {'; '.join(map(_described, places))}."
    return Answer(summary, listed.model_copy(update={"places": places}))


@tool(Role.LOOK)
async def describe_map(
    gateway: GatewayContext,
    picture: Annotated[bool, Field(description="Also return the map as an image.")] = False,
) -> Answer[MapReply]:
    """Size and age of the map, where the robot stands, and what is wrong if something is; with
    picture also an image of the map. Does not move the robot.
    """
    view, state = await gateway.view(), gateway.cache.state
    statistics = map_statistics(view, newest(state.revision), gateway.now_ns())
    robot, stands = None, "no pose of the robot is known"
    if state.robot is not None:
        robot = replies.MapPose(**dict(zip(replies.MapPose.model_fields, state.robot, strict=True)))
        stands = f"the robot stands at {_xy(state.robot)}"
    fault = gateway.fault()
    problem = fault.detail if fault else ""
    summary = (
        f"The map shows {statistics.free_m2:.1f} m2 of free floor and "
        f"{statistics.occupied_m2:.1f} m2 of obstacles from {statistics.frames_fused} frames; "
        f"{stands}. {problem}"
    ).rstrip()
    reply = reply_of(MapReply, statistics, ready=not problem, problem=problem, robot=robot)
    if not picture:
        return Answer(summary, reply)
    overlay = build_overlay(state, gateway.cache.now_s())
    drawn = await to_thread.run_sync(render_map, view, overlay, None, PALETTES[Theme.LIGHT])
    return Answer(summary, reply, await to_thread.run_sync(encode_png, drawn.image))


@tool(Role.LOOK)
async def look_at(
    gateway: GatewayContext,
    object: Annotated[
        schemas.ObjectName, Field(description="Its name, or its id as 'list_objects' gives it.")
    ],
) -> Answer[replies.MapObject]:
    """Show an object that was found: place, time and the picture in which the robot saw it best.
    Does not move the robot.
    """
    for item in await _found(gateway):
        if item.id == object or _is_called(item, object):
            pictured = await gateway.call(keys.MAP_OBJECT, m.ObjectId(item.id))
            seen = map_object(pictured.kept)
            picture = "the picture is from then" if seen.picture else "there is no picture of it"
            seen_at = replies.rfc3339(seen.last_seen_at)
            summary = f"{_place(seen)} was last seen at {seen_at}; {picture}."
            return Answer(summary, seen, pictured.picture)
    raise HttpProblem(
        "unknown_object",
        f"No search has found {object!r} yet: 'list_objects' says what was found, "
        "'where_is' where it may be, and 'start_search' finds it.",
    )


@tool(Role.SEARCH)
async def start_search(
    gateway: GatewayContext,
    objects: Annotated[
        list[SoughtObject],
        Field(min_length=1, max_length=m.MAX_OBJECTS, description="What to find, in this order."),
    ],
    max_distance_m: Distance,
    max_time_s: Time,
    after: schemas.After = "stay",
) -> Answer[search_replies.SearchSnapshot]:
    """MOVES THE ROBOT: explore until the objects are found or the budget of metres and seconds is
    spent. Returns at once; ask 'search_status' every few seconds. One search at a time.
    """
    request = schemas.SearchStart(
        objects=objects, max_distance_m=max_distance_m, max_time_s=max_time_s, after=after
    )
    in_order = " in this order" if len(objects) > 1 else ""
    return await _begun(gateway, request, in_order + (", then back" if after == "return" else ""))


@tool(Role.SEARCH)
async def go_to(
    gateway: GatewayContext,
    place: Annotated[
        schemas.ObjectName,
        Field(
            description="A name of 'list_places', or 'back': where the robot stood when the last "
            "search or drive began."
        ),
    ],
    max_distance_m: Distance,
    max_time_s: Time,
) -> Answer[search_replies.SearchSnapshot]:
    """MOVES THE ROBOT: drive to a place of the map by its name, within the budget of metres and
    seconds. Returns at once; ask 'search_status' every few seconds. It counts as a search.
    """
    request = schemas.SearchStart(go_to=place, max_distance_m=max_distance_m, max_time_s=max_time_s)
    return await _begun(gateway, request)


async def _begun(
    gateway: GatewayContext, request: schemas.SearchStart, how: str = ""
) -> Answer[search_replies.SearchSnapshot]:
    """The search that began; HttpProblem above the budget of an agent, or during another one."""
    budget = {"max_distance_m": request.max_distance_m, "max_time_s": request.max_time_s}
    for name, limit, unit in budget_limits(gateway.config):
        given = budget[name] or limit
        if given > limit:
            raise HttpProblem(
                "invalid",
                f"{name!r} is {given:g}, and one search of an agent may take at most "
                f"{limit:g} {unit} ('gateway.agent_max_distance_m'): give less.",
            )
    try:
        search = await start(gateway, request)
    except HttpProblem as problem:
        if problem.code != "conflict":
            raise
        raise HttpProblem(
            "conflict",
            "The robot is busy with another search: wait until 'search_status' says that it has "
            "ended, or end it with 'stop'.",
        ) from None
    understood = f" Understood as: {search.understood}." if search.understood else ""
    return Answer(
        f"Started the search {search.id} for {_subject(search)}{how}: the robot drives now, at "
        f"most {request.max_distance_m:g} m and {request.max_time_s:g} s. 'search_status' says "
        f"how it goes, 'stop' ends it.{understood}",
        search,
    )


@tool(Role.LOOK)
async def search_status(
    gateway: GatewayContext, search_id: WhichSearch = ""
) -> Answer[search_replies.SearchSnapshot]:
    """How a search goes or how it ended, with what it found. Does not move the robot."""
    search = await gateway.with_places(await gateway.call(keys.SEARCH_GET, m.SearchId(search_id)))
    return Answer(
        f"The search {search.id} for {_subject(search)} is {search.state} after {_spent(search)}: "
        f"{sentence(search.reason)}{_found_names(search)}",
        search,
    )


@tool(Role.SEARCH)
async def stop(
    gateway: GatewayContext, search_id: WhichSearch = ""
) -> Answer[search_replies.SearchSnapshot]:
    """STOPS THE ROBOT and ends the search; what it found so far is kept."""
    before = newest(gateway.cache.state.search)
    search = await gateway.search(keys.SEARCH_CANCEL, m.SearchId(search_id))
    had_ended = before is not None and before.search_id == search.id and not before.active
    if had_ended or search.state != m.SearchState.CANCELLED:
        summary = f"had ended before as {search.state}: there was nothing to stop."
        return Answer(f"The search {search.id} for {_subject(search)} {summary}", search)
    return Answer(
        f"Stopped the search {search.id} for {_subject(search)} after {_spent(search)}: the "
        f"robot brakes and stands.{_found_names(search)}",
        search,
    )


def budget_limits(config: GatewayConfig) -> tuple[tuple[str, float, str], ...]:
    """Argument, highest value and unit of each limit of an agent's search."""
    return (
        ("max_distance_m", config.agent_max_distance_m, "m"),
        ("max_time_s", config.agent_max_distance_m * AGENT_S_PER_M, "s"),
    )


async def _found(gateway: GatewayContext) -> tuple[replies.MapObject, ...]:
    listed = await gateway.call(keys.MAP_OBJECTS, m.ObjectListRequest())
    return tuple(map(map_object, listed.objects))


def _is_called(item: replies.MapObject, name: str) -> bool:
    return item.name.casefold() == name.casefold()


def _subject(search: search_replies.SearchSnapshot) -> str:
    return f"the place {_xy(search.place_m)}" if search.place_m else _names(search.objects)


def _spent(search: search_replies.SearchSnapshot) -> str:
    return f"{search.elapsed_s:.0f} s and {search.path_length_m:.1f} m"


def _found_names(search: search_replies.SearchSnapshot) -> str:
    told = [
        f"{result.name!r}{f' {result.where}' if result.where else ''}"
        for result in search.results
        if result.found
    ]
    return f" Found: {'; '.join(told)}." if told else ""


def _place(item: replies.MapObject) -> str:
    where = f" {item.where}," if item.where else ""
    return f"{item.name!r} ({item.id}){where} at {_xy(item.position_m)}"


def _described(place: place_replies.MapPlace) -> str:
    kind = "no robot enters it" if place.kind == m.PlaceKind.KEEP_OUT else ""
    notes = [kind, "suggested" if place.suggested else "", f"{place.area_m2:.1f} m2"]
    where = _xy(place.inside_m or place.corners_m[0])
    return f"{place.name!r} at {where} ({', '.join(filter(None, notes))})"


def _xy(place_m: Sequence[float]) -> str:
    return f"x {place_m[0]:.2f} m, y {place_m[1]:.2f} m"


def _names(names: Sequence[str]) -> str:
    return ", ".join(map(repr, names))


async def call_tool(
    gateway: GatewayContext, role: Role, name: str, arguments: Mapping[str, Any]
) -> types.CallToolResult:
    """The result of a tool for a client of this role: the summary, the reply, and a picture.

    What cannot be done is an error that says why.
    """
    try:
        answer = await _checked_tool(role, name).run(
            gateway, **dict(TOOLS[name].arguments.model_validate(arguments))
        )
    except ValidationError as error:
        return _failed(from_validation_error(error))
    except HttpProblem as problem:
        return _failed(problem)
    if TOOLS[name].role > Role.LOOK:
        LOG.info("an agent: %s", answer.summary)
    document = finite(answer.reply.model_dump(mode="json"))
    content: list[types.ContentBlock] = [
        types.TextContent(type="text", text=answer.summary),
        # for agents that read no structures
        types.TextContent(type="text", text=json_text(document)),
    ]
    if answer.picture:
        data = base64.b64encode(answer.picture).decode("ascii")
        kind = "image/png" if answer.picture.startswith(b"\x89PNG") else "image/jpeg"
        content.append(types.ImageContent(type="image", data=data, mime_type=kind))
    return types.CallToolResult(content=content, structured_content=document)


def _checked_tool(role: Role, name: str) -> AgentTool:
    """The tool of this name; HttpProblem unless a client of this role may call it."""
    called = TOOLS.get(name)
    if called is None:
        raise HttpProblem(
            "not_found", f"There is no tool {name[:60]!r}: there are {', '.join(TOOLS)}."
        )
    if role < called.role:
        raise HttpProblem(
            "forbidden",
            f"This token may only look, and {name!r} moves or stops the robot: use that of "
            f"'gateway.{TOKENS[called.role]}' or of a higher role.",
        )
    return called


def _failed(problem: HttpProblem) -> types.CallToolResult:
    reason = types.TextContent(type="text", text=problem.detail)
    return types.CallToolResult(content=[reason], is_error=True)


class McpResponse(Response):
    """Answers one request of an agent whose token has ``role``; its body has been read."""

    def __init__(self, gateway: GatewayContext, role: Role, message: bytes) -> None:
        super().__init__()
        self._gateway, self._role, self._message = gateway, role, message

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The ASGI interface."""
        server = Server(
            "onemap",
            title="OneMap",
            instructions=INSTRUCTIONS,
            on_list_tools=self._list_tools,
            on_call_tool=self._call_tool,
        )
        manager = StreamableHTTPSessionManager(server, json_response=True, stateless=True)
        async with manager.run():
            await manager.handle_request(scope, replayed(self._message, receive), send)

    async def _list_tools(
        self, _context: ServerRequestContext[Any], _params: types.PaginatedRequestParams | None
    ) -> types.ListToolsResult:
        config = self._gateway.config
        return types.ListToolsResult(tools=[each.described(config) for each in TOOLS.values()])

    async def _call_tool(
        self, _context: ServerRequestContext[Any], params: types.CallToolRequestParams
    ) -> types.CallToolResult:
        return await call_tool(self._gateway, self._role, params.name, params.arguments or {})
