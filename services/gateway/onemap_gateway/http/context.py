"""What every route gets: state, calls, configuration."""
# Talks: the clock that routes read.

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Annotated, TypeVar

from fastapi import Depends
from starlette.requests import HTTPConnection

from onemap.search_replies import SearchSnapshot
from onemap_gateway.bus.live_state import newest
from onemap_gateway.bus.rpc import RpcClient, served_by
from onemap_gateway.bus.state_cache import StateCache
from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.problems import HttpProblem, from_call_error
from onemap_gateway.http.shared_results import SharedResults
from onemap_gateway.present.metrics import RequestCounter
from onemap_gateway.present.replies import search_snapshot
from onemap_gateway.present.service_status import (
    PipelineFault,
    find_pipeline_fault,
    hung_problem,
    start_problem,
)
from onemap_shared import keys
from onemap_shared.keys import Procedure
from onemap_shared.messages import (
    KeptObject,
    ObjectListRequest,
    SearchState,
    SearchStatus,
    SearchView,
    SearchViewRequest,
)
from onemap_shared.transport import CallError

Q = TypeVar("Q")
R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Paces:
    """Limits in seconds, which only tests change.

    call_timeout_s: for a service's reply. A healthy one needs under 0.5 s; mapper and planner
    themselves wait up to 2 s for perception, then report it missing. start_s: for all calls of a
    request that moves the robot; clients wait 5 s. ready_within_s: since a frame
    reached the map. live_period_s: between two states on /v1/live; the page interpolates. Streams
    look every poll_s for what is new, and ask the planner as often as said.
    """

    call_timeout_s: float = 3.0
    ready_within_s: float = 5.0
    live_period_s: float = 0.2
    poll_s: float = 0.1
    ask_planner_s: float = 2.0
    start_s: float = 4.0


PACES = Paces()
FINDS_S = 0.5  # for the words of finds: a search is told without them where the mapper is slow


@dataclass(frozen=True, slots=True)
class GatewayContext:
    """The state cache, the RPC client and the configuration of one gateway."""

    cache: StateCache
    rpc: RpcClient
    config: GatewayConfig
    robots: Mapping[str, StateCache] = field(default_factory=dict)  # the further ones, by name
    requests: RequestCounter = field(default_factory=RequestCounter)
    paces: Paces = PACES
    images: SharedResults = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "images", SharedResults(self.paces.call_timeout_s))

    def now_ns(self) -> int:
        """The robot's clock now, which stamps captures; the gateway's before the first odometry.

        As the newest odometry and its age tell it: clocks of two computers are not compared.
        """
        newest_odometry = self.cache.state.odometry
        if newest_odometry is None:
            return self.cache.clock.wall_ns()
        since_s = newest_odometry.age_s(self.cache.now_s())
        return newest_odometry.message.stamp_ns + round(since_s * 1e9)

    def fault(self) -> PipelineFault | None:
        """The stage at which frames are lost on their way to the map; None if none is."""
        return find_pipeline_fault(self.cache.state, self.cache.now_s(), self.paces.ready_within_s)

    async def call(
        self, procedure: Procedure[Q, R], request: Q, timeout_s: float | None = None
    ) -> R:
        """The reply of a service, or an ``HttpProblem`` that names the service."""
        limit_s = timeout_s or self.paces.call_timeout_s
        try:
            return await self.rpc.call(procedure, request, limit_s)
        except CallError as error:
            service = served_by(procedure)
            state, now_s = self.cache.state_with_fresh_liveliness(), self.cache.now_s()
            raise from_call_error(
                error,
                service,
                limit_s,
                lambda name: hung_problem(name, state, now_s),
                lambda name: start_problem(name, state),
            ) from error

    def map_revision(self) -> int | None:
        """The revision of the map, as far as it was announced; None before the first."""
        revision = newest(self.cache.state.revision)
        return revision.revision if revision else None

    def robot_xy_m(self) -> tuple[float, ...]:
        """x, y of the robot in metres; empty before its first pose."""
        return (self.cache.state.robot or ())[:2]

    async def search(
        self,
        procedure: Procedure[Q, SearchStatus],
        request: Q,
        timeout_s: float | None = None,
    ) -> SearchSnapshot:
        """The search with which the planner replies; none begins where a recording is played."""
        alive = self.cache.state_with_fresh_liveliness().alive
        if procedure is keys.SEARCH_START and "replay" in alive:
            raise HttpProblem(
                "no_robot",
                "A recording is played in place of a robot, which nothing can move: ask the map "
                "with a query.",
            )
        return search_snapshot(await self.call(procedure, request, timeout_s))

    async def with_places(self, status: SearchStatus) -> SearchSnapshot:
        """The search with where its finds are in words, if the mapper says so in time.

        The robot's stop does not pass here, since this may wait.
        """
        return search_snapshot(status, await self.finds(status))

    async def finds(self, *statuses: SearchStatus) -> tuple[KeptObject, ...]:
        """What the mapper keeps, if one of the searches found anything; nothing without it."""
        if not any(each.outcome is SearchState.FOUND for of in statuses for each in of.results):
            return ()
        with suppress(HttpProblem):
            return (await self.call(keys.MAP_OBJECTS, ObjectListRequest(), FINDS_S)).objects
        return ()

    async def view(self, text: str | None = None) -> SearchView:
        """The current map, with the similarity to ``text`` if given."""
        return await self.call(keys.MAP_SEARCH_VIEW, SearchViewRequest(text or ""))


async def get_gateway(connection: HTTPConnection) -> GatewayContext:
    """The context of the application that serves this connection.

    Asynchronous, as all that a request depends on: FastAPI runs the rest in threads which all
    requests share.
    """
    gateway: GatewayContext = connection.app.state.gateway
    return gateway


GatewayDep = Annotated[GatewayContext, Depends(get_gateway)]
