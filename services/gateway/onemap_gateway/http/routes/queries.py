"""Where is it?"""

from __future__ import annotations

from fastapi import APIRouter

from onemap_gateway.http.context import GatewayDep
from onemap_gateway.http.problem_docs import BODY, problem_responses
from onemap_gateway.http.schemas import QueryRequest
from onemap_gateway.present.replies import QueryReply
from onemap_gateway.present.views import query_reply
from onemap_shared import keys
from onemap_shared.messages import SimilarityRequest

router = APIRouter(prefix="/v1", tags=["queries"])


@router.post(
    "/queries", summary="Where is it?", responses=problem_responses(*BODY, 401, 409, 422, 503)
)
async def ask_where(request: QueryRequest, gateway: GatewayDep) -> QueryReply:
    """Regions of the map that look like the text, best first, without moving the robot."""
    similarity = SimilarityRequest(request.text, request.max_regions, request.include_grid)
    reply = await gateway.call(keys.MAP_SIMILARITY, similarity)
    return query_reply(reply, gateway.now_ns())
