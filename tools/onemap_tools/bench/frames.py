"""Frames of a scene, the map of any frames, and its answer to a word: pure, without a bus."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_mapper.query.replies import similarity_reply
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_shared.geometry import F64
from onemap_shared.messages import RgbdFrame, SimilarityReply, SimilarityRequest
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, measured_mm
from onemap_simulator.scene.scene import Scene

FRAME_NS = 100_000_000


def rendered_frames(
    scene: Scene, camera: CameraParams, poses: Iterable[F64]
) -> Iterator[tuple[RgbdFrame, RenderedImage]]:
    """What the camera sees from poses T_map_camera (4, 4), and what the renderer says of it."""
    renderer = Renderer(scene)
    for index, pose in enumerate(poses):
        view = renderer.render(pose, camera.intrinsics, width=camera.width, height=camera.height)
        depth_mm = measured_mm(view.depth_m, camera.min_depth_m, camera.max_depth_m)
        stamp_ns = (index + 1) * FRAME_NS
        yield RgbdFrame(index, stamp_ns, view.rgb, depth_mm, camera.intrinsics, pose), view


def map_of(
    frames: Iterable[RgbdFrame], encoder: Encoder, variance: VarianceParams, params: MapParams
) -> BeliefMap:
    """The map of all frames."""
    belief = BeliefMap(params)
    for frame in frames:
        field = feature_field(frame, encoder.encode(frame.rgb), encoder, variance)
        belief.fuse(compute_update(field, params))
    return belief


def answer(
    belief: BeliefMap, query: TextQuery, *, max_regions: int, grid: bool = False
) -> SimilarityReply:
    """The map's regions for a query, with the score of every cell if ``grid``."""
    request = SimilarityRequest(query.text, max_regions=max_regions, include_grid=grid)
    return similarity_reply(MapScores(belief).of([query]), request=request)
