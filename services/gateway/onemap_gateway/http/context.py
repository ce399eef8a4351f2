"""What every route works with."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection

from onemap_gateway.bus.rpc import RpcClient
from onemap_gateway.bus.state_cache import StateCache
from onemap_gateway.config import GatewayConfig
from onemap_gateway.present.metrics import RequestCounter
from onemap_gateway.present.service_status import PipelineFault, find_pipeline_fault
from onemap_shared import keys
from onemap_shared.messages import SearchView, SearchViewRequest


@dataclass(frozen=True, slots=True)
class GatewayContext:
    """The ear, the mouth and the settings of one gateway."""

    cache: StateCache
    rpc: RpcClient
    config: GatewayConfig
    requests: RequestCounter = field(default_factory=RequestCounter)

    def now_ns(self) -> int:
        """The wall clock, which capture stamps refer to."""
        return time.time_ns()

    def fault(self) -> PipelineFault | None:
        """Where frames get lost on their way to the map, if they do."""
        return find_pipeline_fault(self.cache.state, self.cache.now_s(), self.config.ready_within_s)

    async def view(self, text: str | None = None) -> SearchView:
        """The map as it is now, with the similarity to ``text`` if there is one."""
        return await self.rpc.call(keys.MAP_SEARCH_VIEW, SearchViewRequest(text or ""))


def get_gateway(connection: HTTPConnection) -> GatewayContext:
    """The gateway that the application was made for."""
    gateway: GatewayContext = connection.app.state.gateway
    return gateway


GatewayDep = Annotated[GatewayContext, Depends(get_gateway)]
