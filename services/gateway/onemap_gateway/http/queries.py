"""Queries of the map: all texts of a request at once, judged from where the robot stands."""
# Talks: asks for several texts at once.

from __future__ import annotations

import anyio

from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.http.schemas import IMAGE_NAME, QueryRequest
from onemap_gateway.present.queries import IMAGE_SUBJECT, QueryReply, query_reply
from onemap_gateway.present.views import with_scores
from onemap_shared import keys
from onemap_shared.messages import ImageSimilarityRequest, SearchView, SimilarityRequest


async def answers(gateway: GatewayContext, request: QueryRequest) -> list[QueryReply]:
    """The answers to the texts, in their order, or to the image; HttpProblem if one fails."""
    asked = request.requests(robot_xy_m(gateway))
    if len(asked) == 1:
        return [await answer(gateway, asked[0])]
    replies: list[QueryReply | HttpProblem | None] = [None] * len(asked)

    async def ask(index: int) -> None:
        try:
            replies[index] = await answer(gateway, asked[index])
        except HttpProblem as problem:  # a task group would wrap it
            replies[index] = problem

    async with anyio.create_task_group() as tasks:
        for index in range(len(asked)):
            tasks.start_soon(ask, index)
    found = []
    for reply in replies:
        if isinstance(reply, HttpProblem):
            raise reply
        if reply is not None:
            found.append(reply)
    return found


async def answer(
    gateway: GatewayContext, request: SimilarityRequest | ImageSimilarityRequest
) -> QueryReply:
    """The answer to one text or image."""
    if isinstance(request, ImageSimilarityRequest):
        reply = await gateway.call(keys.MAP_IMAGE_SIMILARITY, request)
        return query_reply(reply, gateway.now_ns(), subject=IMAGE_SUBJECT)
    reply = await gateway.call(keys.MAP_SIMILARITY, request)
    return query_reply(reply, gateway.now_ns())


async def image_view(gateway: GatewayContext, image: bytes) -> SearchView:
    """The map, with the score of each cell against what an image shows."""
    query = SimilarityRequest(IMAGE_NAME, max_regions=1, include_grid=True)
    reply = await gateway.call(keys.MAP_IMAGE_SIMILARITY, ImageSimilarityRequest(image, query))
    return with_scores(await gateway.view(), reply)


def robot_xy_m(gateway: GatewayContext) -> tuple[float, ...]:
    """x, y of the robot in metres, empty if nothing is known of it."""
    odometry = gateway.cache.state.odometry
    if odometry is None:
        return ()
    x_m, y_m = odometry.message.T_map_body[:2, 3]
    return (float(x_m), float(y_m))
