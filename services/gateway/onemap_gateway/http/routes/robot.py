"""Is the robot running, and if not, why? Its state, live and in numbers."""
# Talks: waits between two states.

from __future__ import annotations

from functools import partial

import anyio
from fastapi import APIRouter, Request, Response, WebSocket
from pydantic import BaseModel, Field

from onemap.replies import SystemStatus
from onemap_gateway.bus.state_cache import StateCache
from onemap_gateway.config import Role
from onemap_gateway.http.context import GatewayContext, GatewayDep, get_gateway
from onemap_gateway.http.middleware import FOLDER
from onemap_gateway.http.problems import HttpProblem, content, problem_responses
from onemap_gateway.http.security import ROLE
from onemap_gateway.http.streams import GOING_AWAY, accept, speak
from onemap_gateway.present.formats import json_text
from onemap_gateway.present.live import live_document
from onemap_gateway.present.metrics import MEDIA_TYPE, exposition
from onemap_gateway.present.replies import system_status
from onemap_gateway.present.service_status import find_pipeline_fault


class RobotReport(BaseModel):
    """One of several robots behind this gateway."""

    name: str
    namespace: str = Field(description="Prefix of its keys on the bus.")
    address: str = Field(description="What this document's addresses begin with for this robot.")
    ready: bool = Field(description="As /readyz.")
    problem: str = Field(description="The reason why not; empty when all is well.")
    services: list[str] = Field(description="Those of its processes that are connected now.")
    shares_map_with: list[str] = Field(description="Names of the others on its map.")


class RobotList(BaseModel):
    """The robots of ``gateway.robots``."""

    robots: list[RobotReport]
    role: str = Field(description="What the token of this request may: look, search, administer.")


class HealthReply(BaseModel):
    """Liveness of the gateway, or readiness of the whole robot."""

    status: str = Field(examples=["ok"])


router = APIRouter(tags=["health"])
robots_router = APIRouter(prefix="/v1", tags=["robots"])


@router.get("/healthz", summary="Does the gateway live?")
async def get_health() -> HealthReply:
    """200 as long as the gateway's process answers."""
    return HealthReply(status="ok")


@router.get("/readyz", summary="Does the robot work?", responses=problem_responses(503))
async def get_ready(gateway: GatewayDep) -> HealthReply:
    """200 only if a camera frame went all the way to the map within the last 5 s, and perception,
    mapper and planner are there now.

    Otherwise 503, and `service` names the stage that is missing or silent: robot, perception,
    mapper or planner.
    """
    fault = gateway.fault()
    if fault is not None:
        raise HttpProblem("not_ready", fault.detail, service=fault.service)
    return HealthReply(status="ok")


@router.get("/v1/status", summary="What runs, and how")
async def get_status(gateway: GatewayDep) -> SystemStatus:
    """Every service and stream: alive, ready, age, rate, metrics, and what is wrong."""
    cache = gateway.cache
    return system_status(cache.state, cache.counters(), gateway.fault(), cache.now_s())


@router.get(
    "/metrics",
    summary="Numbers for Prometheus",
    response_class=Response,
    responses={200: content("text/plain")},
)
async def get_metrics(gateway: GatewayDep) -> Response:
    """Prometheus text format: every service's metrics as `onemap_<service>_<name>`."""
    cache = gateway.cache
    text = exposition(cache.state, cache.counters(), gateway.requests, cache.now_s())
    return Response(text, headers={"Content-Type": MEDIA_TYPE})


@robots_router.get("/robots", summary="Which robots does this gateway serve?")
async def get_robots(gateway: GatewayDep, request: Request) -> RobotList:
    """The robots of `gateway.robots`, in that order; empty where the gateway has only its own.

    `address` is what the addresses of a robot begin with: `/robots/r1/v1/status`.
    """

    def mapper(name: str) -> str:
        record = gateway.robots[name].state.heartbeats.get("mapper")
        return record.heartbeat.instance if record else ""

    def report(name: str, cache: StateCache) -> RobotReport:
        state = cache.state
        others = [each for each in gateway.robots if each != name and mapper(each) == mapper(name)]
        fault = find_pipeline_fault(state, cache.now_s(), gateway.paces.ready_within_s)
        return RobotReport(
            name=name,
            namespace=gateway.config.robots[name],
            address=FOLDER + name,
            ready=fault is None,
            problem=fault.detail if fault else "",
            services=sorted(state.alive),
            shares_map_with=others if mapper(name) else [],
        )

    robots = [report(name, cache) for name, cache in gateway.robots.items()]
    role: Role = request.scope[ROLE]
    return RobotList(robots=robots, role=role.name.lower())


@router.websocket("/v1/live")
async def follow(socket: WebSocket) -> None:
    """Send the newest state until the client leaves; its messages are ignored.

    Each client has its own loop and gets the state of the moment in which it is ready for
    more: a slow one misses states and delays no other client.
    """
    await accept(socket)
    await speak(socket, partial(_send_states, socket, await get_gateway(socket)))


async def _send_states(socket: WebSocket, gateway: GatewayContext) -> None:
    first = True
    while not gateway.cache.closing:
        document = live_document(
            gateway.cache.state,
            gateway.fault(),
            now_s=gateway.cache.now_s(),
            now_ns=gateway.now_ns(),
            with_trail=first,
        )
        await socket.send_text(json_text(document))
        first = False
        await anyio.sleep(gateway.paces.live_period_s)
    await socket.close(GOING_AWAY)
