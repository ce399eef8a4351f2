"""Is it running, and if not, why?"""

from __future__ import annotations

from fastapi import APIRouter, Response

from onemap_gateway.http.context import GatewayDep
from onemap_gateway.http.problem_docs import problem_responses
from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.present.metrics import MEDIA_TYPE, exposition
from onemap_gateway.present.replies import HealthReply, StatusReport
from onemap_gateway.present.views import status_report

router = APIRouter(tags=["health"])


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
async def get_status(gateway: GatewayDep) -> StatusReport:
    """Every service and stream: alive, ready, age, rate, metrics, and what is wrong."""
    cache = gateway.cache
    return status_report(cache.state, cache.counters(), gateway.fault(), cache.now_s())


@router.get(
    "/metrics",
    summary="Numbers for Prometheus",
    response_class=Response,
    responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
)
async def get_metrics(gateway: GatewayDep) -> Response:
    """Prometheus text format: every service's metrics as `onemap_<service>_<name>`."""
    cache = gateway.cache
    text = exposition(cache.state, cache.counters(), gateway.requests, cache.now_s())
    return Response(text, headers={"Content-Type": MEDIA_TYPE})
