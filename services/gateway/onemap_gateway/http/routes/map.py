"""The map (image, arrays, numbers), saved maps, and the camera's image."""
# Talks: draws and encodes in threads.

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable, Hashable
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from typing import Annotated

from anyio import to_thread
from fastapi import APIRouter, Depends, Path, Query, Response
from pydantic import AfterValidator, ValidationError

from onemap.replies import (
    MapContent,
    MapListReply,
    MapStatistics,
    StoredMap,
)
from onemap_gateway.bus.live_state import newest
from onemap_gateway.http.context import GatewayContext, GatewayDep
from onemap_gateway.http.problems import (
    HttpProblem,
    content,
    from_validation_error,
    problem_responses,
)
from onemap_gateway.http.routes.queries import image_view
from onemap_gateway.http.schemas import (
    ComparedImage,
    Described,
    MergeRequest,
    ObjectName,
)
from onemap_gateway.http.sentences import understand
from onemap_gateway.http.shared_results import SharedResponse
from onemap_gateway.present.live import build_overlay
from onemap_gateway.present.palette import PALETTES, Theme
from onemap_gateway.present.render import (
    MAX_SCALE,
    MapImage,
    annotate_detections,
    encode_jpeg,
    encode_png,
    render_map,
    render_tops,
)
from onemap_gateway.present.replies import map_archive, map_statistics
from onemap_shared import keys
from onemap_shared import messages as m

router = APIRouter(prefix="/v1", tags=["map"])
maps_router = APIRouter(prefix="/v1", tags=["maps"])
camera_router = APIRouter(prefix="/v1", tags=["camera"])

Text = Annotated[
    ObjectName | None, Query(description="Also the similarity to this.", examples=["sofa"])
]


PICTURE = content(
    "image/png",
    "Unknown is dark, free is grey, occupied is light, the more so the higher it reaches (with "
    "`theme=light` free is white, occupied is dark); x to the right, y up. `X-OneMap-Bounds` holds "
    "x_min, y_min, x_max, y_max in metres.",
    format="binary",
)
HEIGHTS = content(
    "image/png",
    "The grey value is the height in decimetres, within 1, of what stands in an occupied cell; 22: "
    "that or more, 0: elsewhere, or not known. `X-OneMap-Bounds` as of the map.",
    format="binary",
)
ARCHIVE = content(
    "application/octet-stream", "A NumPy archive (load it with `numpy.load`).", format="binary"
)
JPEG = content(
    "image/jpeg",
    "`X-OneMap-Sequence` is the frame's number, `X-OneMap-Age` its age in seconds since it "
    "arrived.",
    format="binary",
)


@dataclass(frozen=True, slots=True)
class Drawing:
    """How the map is drawn."""

    scale: Annotated[
        int | None,
        Query(ge=1, le=MAX_SCALE, description="Pixels per cell; by default a size for screens."),
    ] = None
    marks: Annotated[
        bool, Query(description="Draw robot, trail, path, frontiers, found objects, a scale bar.")
    ] = True
    theme: Annotated[Theme, Query(description="Colours for a dark or a light page.")] = Theme.DARK


DrawingDep = Annotated[Drawing, Depends()]


@router.get("/map", summary="The map in numbers", responses=problem_responses(422, 503))
async def get_map(gateway: GatewayDep) -> MapStatistics:
    """Revision, age, extent and areas of the map."""
    view = await gateway.view()
    return map_statistics(view, newest(gateway.cache.state.revision), gateway.now_ns())


@router.get(
    "/map.png",
    summary="The map as an image",
    response_class=Response,
    responses={200: PICTURE, **problem_responses(409, 422, 503)},
)
async def get_map_picture(gateway: GatewayDep, how: DrawingDep, text: Text = None) -> Response:
    """The mapped floor, the similarity to the object of `text`, and what the robot is doing."""
    name = await _named(gateway, text)
    return await _picture(gateway, name, how, partial(gateway.view, name))


@router.post(
    "/map.png",
    summary="The map as an image, with similarity",
    response_class=Response,
    responses={200: PICTURE, **problem_responses(409, 422, 503)},
)
async def draw_image_similarity(
    request: ComparedImage, gateway: GatewayDep, how: DrawingDep
) -> Response:
    """The same with the similarity to what an image shows: its scores rank, they are no
    probabilities."""
    compared = sha256(request.image).digest()
    return await _picture(gateway, compared, how, partial(image_view, gateway, request.image))


async def _named(gateway: GatewayContext, text: str | None) -> str | None:
    """The object that a sentence asks for: cells resemble it, not what is said of where it is."""
    if not text:
        return text
    try:
        described = Described(text=text)
    except ValidationError as error:
        raise from_validation_error(error) from None
    (sentence,) = (await understand(gateway, [described])).sentences
    return sentence.name


async def _picture(
    gateway: GatewayContext,
    compared: str | bytes | None,
    how: Drawing,
    look: Callable[[], Awaitable[m.SearchView]],
) -> Response:
    """The image of the view that ``look`` gives; compared: with what, None for nothing."""

    def render(view: m.SearchView) -> MapImage:
        drawn = build_overlay(gateway.cache.state, gateway.cache.now_s()) if how.marks else None
        return render_map(view, drawn, how.scale, PALETTES[how.theme])

    return await _shared_png(gateway, ("map.png", compared, how), look, render)


async def _shared_png(
    gateway: GatewayContext,
    request: Hashable,
    look: Callable[[], Awaitable[m.SearchView]],
    render: Callable[[m.SearchView], MapImage],
) -> Response:
    """The image that ``render`` makes of a view, one for all who ask for the same."""

    async def draw() -> tuple[bytes, dict[str, str]]:
        view = await look()
        map_image = await to_thread.run_sync(render, view)
        data = await to_thread.run_sync(encode_png, map_image.image)
        return data, {
            "X-OneMap-Bounds": ",".join(f"{value:.4f}" for value in map_image.bounds_m),
            "X-OneMap-Revision": str(view.revision),
        }

    image = await gateway.images.get(request, gateway.map_revision(), draw)
    return SharedResponse(image.body, media_type="image/png", headers=image.headers)


@router.get(
    "/map/heights.png",
    summary="How high obstacles reach",
    response_class=Response,
    responses={200: HEIGHTS, **problem_responses(503)},
)
async def get_map_heights(gateway: GatewayDep) -> Response:
    """A pixel for each cell of the part of the map that `map.png?marks=false` shows."""
    return await _shared_png(gateway, "heights.png", gateway.view, render_tops)


@router.get(
    "/map.npz",
    summary="The map as arrays",
    response_class=Response,
    responses={200: ARCHIVE, **problem_responses(409, 422, 503)},
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

    name = await _named(gateway, text)

    async def pack() -> tuple[bytes, dict[str, str]]:
        data = await to_thread.run_sync(map_archive, await gateway.view(name))
        return data, {"Content-Disposition": 'attachment; filename="map.npz"'}

    archive = await gateway.images.get(("map.npz", name), gateway.map_revision(), pack)
    return SharedResponse(
        archive.body, media_type="application/octet-stream", headers=archive.headers
    )


@router.post("/map/clear", summary="Forget the map", responses=problem_responses(503))
async def clear_map(gateway: GatewayDep) -> MapContent:
    """Empty the map."""
    return MapContent.model_validate(await gateway.call(keys.MAP_CLEAR, m.MapClear()))


NO_MOTION = MergeRequest()
JPEG_QUALITY = 80  # percent: shows no blocks
FILE_S = 20.0  # a map of hundreds of megabytes on the card of a Jetson

MAP_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


def check_map_name(name: str) -> str:
    """Return ``name``, or raise ValueError with what a name may be."""
    if not MAP_NAME.fullmatch(name):
        raise ValueError(
            "the name of a map begins with a letter or a digit and consists of at most 64 letters "
            "(A-Z, a-z), digits, '.', '_' and '-'; no folder"
        )
    return name


Name = Annotated[
    str,
    AfterValidator(check_map_name),
    Path(
        description="Begins with a letter or a digit; letters A-Z and a-z, digits, '.', '_' and "
        "'-', at most 64; no folder.",
        json_schema_extra={"pattern": f"^{MAP_NAME.pattern}$"},
        examples=["flat"],
    ),
]


@maps_router.get("/maps", summary="What was saved?", responses=problem_responses(503))
async def list_maps(gateway: GatewayDep) -> MapListReply:
    """The maps in the mapper's map folder, newest first; damaged ones say why."""
    return MapListReply.model_validate(await gateway.call(keys.MAP_LIST, m.MapListRequest()))


@maps_router.get("/maps/{name}", summary="A saved map", responses=problem_responses(404, 422, 503))
async def get_saved_map(name: Name, gateway: GatewayDep) -> StoredMap:
    """Size, encoder and time of a saved map, without its cells."""
    (saved,) = (await gateway.call(keys.MAP_LIST, m.MapListRequest(name))).maps
    return StoredMap.model_validate(saved)


@maps_router.put(
    "/maps/{name}",
    summary="Save the map",
    responses={
        201: {
            "model": MapContent,
            "description": "No map had this name.",
            "headers": {"Location": {"schema": {"type": "string"}}},
        },
        **problem_responses(409, 422, 503, 507),
    },
)
async def put_map(name: Name, gateway: GatewayDep, response: Response) -> MapContent:
    """Write the map to a file in the mapper's map folder; an older one is replaced."""
    summary = await gateway.call(keys.MAP_SAVE, m.MapFile(name), FILE_S)
    if summary.created:
        response.status_code = 201
        response.headers["Location"] = f"/v1/maps/{name}"
    return MapContent.model_validate(summary)


@maps_router.delete(
    "/maps/{name}",
    summary="Delete a saved map",
    responses=problem_responses(404, 422, 503, 507),
)
async def delete_map(name: Name, gateway: GatewayDep) -> StoredMap:
    """Delete a file of the mapper's map folder and say what it was; the map in use stays."""
    return StoredMap.model_validate(await gateway.call(keys.MAP_DELETE, m.MapFile(name)))


@maps_router.post(
    "/maps/{name}/load",
    summary="Load a saved map",
    responses=problem_responses(404, 409, 422, 503),
)
async def load_saved_map(name: Name, gateway: GatewayDep) -> MapContent:
    """Replace the map by a saved one; refused if another encoder made it."""
    return MapContent.model_validate(await gateway.call(keys.MAP_LOAD, m.MapFile(name), FILE_S))


@maps_router.post(
    "/maps/{name}/merge",
    summary="Merge a saved map into the map in use",
    responses=problem_responses(404, 409, 422, 503),
)
async def merge_saved_map(
    name: Name, gateway: GatewayDep, request: MergeRequest = NO_MOTION
) -> MapContent:
    """Fuse a saved map of the same frame, or of one that lies in it as the body says.

    Features are weighted by the inverse of their variance, so that it does not matter which of both
    maps came first; found objects that are none of ours are added. Refused if another encoder made
    it.
    """
    merge = m.MapMerge(name, request.x_m, request.y_m, request.yaw_rad)
    return MapContent.model_validate(await gateway.call(keys.MAP_MERGE, merge, FILE_S))


@camera_router.get(
    "/camera.jpg",
    summary="The camera's newest image",
    response_class=Response,
    responses={200: JPEG, **problem_responses(422, 503)},
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
            "No camera frame has arrived yet: check the robot and its driver, simulator or replay.",
            service="robot",
        )
    frame = state.frame.message
    drawn = state.detections_now(now_s) if detections else None

    async def draw() -> tuple[bytes, dict[str, str]]:
        image = await to_thread.run_sync(annotate_detections, frame.rgb, drawn)
        data = await to_thread.run_sync(encode_jpeg, image, JPEG_QUALITY)
        return data, {"X-OneMap-Sequence": str(frame.sequence)}

    version = (state.frame.arrived_s, frame.sequence, drawn.sequence if drawn else None)
    image = await gateway.images.get(("camera.jpg", detections), version, draw)
    headers = {**image.headers, "X-OneMap-Age": f"{state.frame.age_s(now_s):.3f}"}
    return SharedResponse(image.body, media_type="image/jpeg", headers=headers)
