"""The map: image, arrays, numbers."""
# Talks: draws in a thread.

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from typing import Annotated, Any

from anyio import to_thread
from fastapi import APIRouter, Depends, Query, Response

from onemap_gateway.http.context import GatewayContext, GatewayDep
from onemap_gateway.http.problem_docs import BODY, problem_responses
from onemap_gateway.http.queries import image_view
from onemap_gateway.http.schemas import ComparedImage, ObjectName
from onemap_gateway.http.shared_results import SharedResponse
from onemap_gateway.present.palette import PALETTES, Theme
from onemap_gateway.present.render import MAX_SCALE, encode_png, render_map
from onemap_gateway.present.replies import MapChange, MapInfo
from onemap_gateway.present.views import build_overlay, map_archive, map_change, map_info
from onemap_shared import keys
from onemap_shared.messages import MapClear, SearchView

router = APIRouter(prefix="/v1", tags=["map"])

Text = Annotated[
    ObjectName | None, Query(description="Also the similarity to this.", examples=["sofa"])
]


PICTURE: dict[str, Any] = {
    "description": "Unknown is dark, free is grey, occupied is light (with `theme=light` free is "
    "white, occupied is dark); x to the right, y up. `X-OneMap-Bounds` holds x_min, y_min, x_max, "
    "y_max in metres.",
    "content": {"image/png": {"schema": {"type": "string", "format": "binary"}}},
}


@dataclass(frozen=True, slots=True)
class Drawing:
    """How the map is drawn."""

    scale: int | None
    marks: bool
    theme: Theme


async def drawing(
    scale: Annotated[
        int | None,
        Query(ge=1, le=MAX_SCALE, description="Pixels per cell; by default a size for screens."),
    ] = None,
    marks: Annotated[
        bool, Query(description="Draw robot, trail, path, frontiers, found objects, a scale bar.")
    ] = True,
    theme: Annotated[Theme, Query(description="Colours for a dark or a light page.")] = Theme.DARK,
) -> Drawing:
    """How the address asks for it."""
    return Drawing(scale, marks, theme)


DrawingDep = Annotated[Drawing, Depends(drawing)]


@router.get("/map", summary="The map in numbers", responses=problem_responses(422, 503))
async def get_map(gateway: GatewayDep) -> MapInfo:
    """Revision, age, extent and areas of the map."""
    view = await gateway.view()
    revision = gateway.cache.state.revision
    return map_info(view, revision.message if revision else None, gateway.now_ns())


@router.get(
    "/map.png",
    summary="The map as an image",
    response_class=Response,
    responses={200: PICTURE, **problem_responses(409, 422, 503)},
)
async def get_map_picture(gateway: GatewayDep, how: DrawingDep, text: Text = None) -> Response:
    """The mapped floor, the similarity to `text`, and what the robot is doing."""
    return await _picture(gateway, text, how, partial(gateway.view, text))


@router.post(
    "/map.png",
    summary="The map as an image, with the similarity to an image",
    response_class=Response,
    responses={200: PICTURE, **problem_responses(*BODY, 401, 409, 422, 503)},
)
async def draw_image_similarity(
    request: ComparedImage, gateway: GatewayDep, how: DrawingDep
) -> Response:
    """The same with the similarity to what an image shows: its scores rank, they are no
    probabilities."""
    compared = sha256(request.image).digest()
    return await _picture(gateway, compared, how, partial(image_view, gateway, request.image))


async def _picture(
    gateway: GatewayContext,
    compared: str | bytes | None,
    how: Drawing,
    look: Callable[[], Awaitable[SearchView]],
) -> Response:
    """The image of the view that ``look`` gives; compared: with what, None for nothing."""

    async def draw() -> tuple[bytes, dict[str, str]]:
        view = await look()
        drawn = build_overlay(gateway.cache.state, gateway.cache.now_s()) if how.marks else None
        palette = PALETTES[how.theme]
        map_image = await to_thread.run_sync(render_map, view, drawn, how.scale, palette)
        data = await to_thread.run_sync(encode_png, map_image.image)
        return data, {
            "X-OneMap-Bounds": ",".join(f"{value:.4f}" for value in map_image.bounds_m),
            "X-OneMap-Revision": str(view.revision),
        }

    asked = ("map.png", compared, how)
    image = await gateway.images.get(asked, gateway.map_revision(), draw)
    return SharedResponse(image.body, media_type="image/png", headers=image.headers)


@router.get(
    "/map.npz",
    summary="The map as arrays",
    response_class=Response,
    responses={
        200: {
            "description": "A NumPy archive (load it with `numpy.load`).",
            "content": {
                "application/octet-stream": {"schema": {"type": "string", "format": "binary"}}
            },
        },
        **problem_responses(409, 422, 503),
    },
)
async def get_map_arrays(gateway: GatewayDep, text: Text = None) -> Response:
    """The map for programs: a NumPy archive without pickled objects.

    - `occupancy` (nx, ny) uint8: 0 unknown, 1 free, 2 occupied
    - `layers` (nx, ny) uint8, bits: 1 observed, 2 explored, 4 searched, 8 free floor
      that no camera saw, where the robot was put down
    - `similarity` (nx, ny) float32: score 0 to 1, NaN where not observed; (0, 0) without `text`
    - `origin_m` (2,): x, y of the lower left corner of cell [0, 0], in metres
    - `cell_size_m`, `revision`, `stamp_ns` (newest frame; 0: empty map), `text`

    Arrays are indexed [ix, iy]: the first axis follows the map's x, the second its y.
    """

    async def pack() -> tuple[bytes, dict[str, str]]:
        data = await to_thread.run_sync(map_archive, await gateway.view(text))
        return data, {"Content-Disposition": 'attachment; filename="map.npz"'}

    archive = await gateway.images.get(("map.npz", text), gateway.map_revision(), pack)
    return SharedResponse(
        archive.body, media_type="application/octet-stream", headers=archive.headers
    )


@router.post("/map/clear", summary="Forget the map", responses=problem_responses(401, 503))
async def clear_map(gateway: GatewayDep) -> MapChange:
    """Empty the map."""
    return map_change(await gateway.call(keys.MAP_CLEAR, MapClear()))
