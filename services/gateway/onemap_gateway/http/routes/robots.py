"""Which robots are behind this gateway?"""

from __future__ import annotations

from fastapi import APIRouter

from onemap_gateway.bus.state_cache import StateCache
from onemap_gateway.http.context import GatewayDep
from onemap_gateway.http.fleet import FOLDER
from onemap_gateway.present.replies import RobotList, RobotReport
from onemap_gateway.present.service_status import find_pipeline_fault

router = APIRouter(prefix="/v1", tags=["robots"])


@router.get("/robots", summary="Which robots does this gateway serve?")
async def get_robots(gateway: GatewayDep) -> RobotList:
    """The robots of `gateway.robots`, in that order; empty where the gateway has only its own.

    `address` is what the addresses of a robot begin with: `/robots/r1/v1/status`.
    """

    def report(name: str, cache: StateCache) -> RobotReport:
        state = cache.state
        fault = find_pipeline_fault(state, cache.now_s(), gateway.config.ready_within_s)
        return RobotReport(
            name=name,
            namespace=gateway.config.robots[name],
            address=FOLDER + name,
            ready=fault is None,
            problem=fault.detail if fault else "",
            services=sorted(state.alive),
        )

    return RobotList(robots=[report(name, cache) for name, cache in gateway.robots.items()])
