"""The newest camera image."""
# Talks: encodes in a thread.

from __future__ import annotations

from typing import Annotated

from anyio import to_thread
from fastapi import APIRouter, Query, Response

from onemap_gateway.http.context import GatewayDep
from onemap_gateway.http.problem_docs import problem_responses
from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.http.shared_results import SharedResponse
from onemap_gateway.present.camera_image import annotate_detections, encode_jpeg

router = APIRouter(prefix="/v1", tags=["camera"])


@router.get(
    "/camera.jpg",
    summary="The camera's newest image",
    response_class=Response,
    responses={
        200: {
            "description": "`X-OneMap-Sequence` is the frame's number, `X-OneMap-Age` its age in "
            "seconds since it arrived.",
            "content": {"image/jpeg": {"schema": {"type": "string", "format": "binary"}}},
        },
        **problem_responses(422, 503),
    },
)
async def get_camera(
    gateway: GatewayDep,
    detections: Annotated[bool, Query(description="Draw what was detected.")] = True,
) -> Response:
    """The newest image, with a labelled box around each detection of the last moments."""
    state, now_s = gateway.cache.state, gateway.cache.now_s()
    if state.frame is None:
        raise HttpProblem(
            "unavailable",
            "No camera frame has arrived yet: is the robot (simulator, replay or a driver) "
            "running?",
            service="robot",
        )
    frame = state.frame.message
    drawn = state.detections_now(now_s) if detections else None

    async def draw() -> tuple[bytes, dict[str, str]]:
        image = await to_thread.run_sync(annotate_detections, frame.rgb, drawn)
        data = await to_thread.run_sync(encode_jpeg, image, gateway.config.jpeg_quality)
        return data, {"X-OneMap-Sequence": str(frame.sequence)}

    version = (state.frame.arrived_s, frame.sequence, drawn.sequence if drawn else None)
    image = await gateway.images.get(("camera.jpg", detections), version, draw)
    headers = {**image.headers, "X-OneMap-Age": f"{state.frame.age_s(now_s):.3f}"}
    return SharedResponse(image.body, media_type="image/jpeg", headers=headers)
