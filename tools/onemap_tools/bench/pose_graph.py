"""What a correction of the pose does to the map: a drive with drift and one loop closure.

The robot drives through an apartment and back to its start while its odometry drifts. There the
loop is closed, and it drives the first part of its way again with right poses. The same frames are
mapped with true poses, without the correction, and with it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from onemap_gateway.present.render import encode_png, render_map
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.submaps import SubmapStore
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.update import compute_update
from onemap_mapper.query.replies import search_view, similarity_reply
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import text_query
from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.feature_field import feature_field
from onemap_perception.variance import VarianceParams
from onemap_shared.geometry import F64, U8, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import (
    FeatureField,
    Occupancy,
    PoseGraph,
    RgbdFrame,
    SimilarityRequest,
)
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from onemap_simulator.ground_truth.truth import SceneTruth
from onemap_simulator.rendering.label_renderer import LabelRenderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, measured_mm
from onemap_simulator.scene.cell_masks import dilated
from onemap_simulator.scene.occupancy_raster import occupied_cells
from onemap_simulator.scene.scene import STRUCTURE, Scene
from onemap_tools.bench.loop_drive import OdometryDrift, drifting, loop_closed, loop_drive
from onemap_tools.bench.navigation.simulated_features import (
    SimulatedEncoder,
    SimulatedFeatureParams,
)

CAMERA = CameraParams(width=160, height=120)
FRAME_NS = 250_000_000
PLACES = 8  # that the drive visits
AGAIN = 0.35  # of the way is driven once more after the loop was closed
KEYFRAME_FRAMES = 8  # a keyframe of SLAM every so many frames: a metre of way
KNOWN_WITHIN_M = 0.5  # with true poses: of a name that is not there, any answer is wrong
# Each object looks like what it is, so that only the pose moves an answer.
FEATURES = SimulatedFeatureParams(confusion=0.0, object_noise=0.0)
ROWS = ("true poses", "not corrected", "corrected")


@dataclass(frozen=True, slots=True)
class PoseGraphBenchParams:
    """drift and yaw_deg_per_m: of the odometry; out: folder of the pictures, if any."""

    seeds: tuple[int, ...]
    drift: float = 0.02
    yaw_deg_per_m: float = 0.25
    out: Path | None = None
    mapper: MapperConfig = field(default_factory=MapperConfig)


@dataclass(frozen=True, slots=True)
class DrivenLoop:
    """A scene, its frames as seen, with the poses as they are, as they were said, and corrected.

    ``closed``: frames up to the loop closure; those after it are said to be where they are.
    ``truth`` measures how far from an object a place is.
    """

    scene: Scene
    encoder: SimulatedEncoder
    fields: tuple[FeatureField, ...]
    true: F64
    said: F64
    corrected: F64
    closed: int
    truth: SceneTruth


@dataclass(frozen=True, slots=True)
class MovedSubmaps:
    """What following the graph took: submaps, those moved, milliseconds, bytes of all."""

    count: int
    moved: int
    total_ms: float
    nbytes: int


def run(params: PoseGraphBenchParams) -> dict[str, Any]:
    """All apartments: each map's errors, and what moving the submaps took."""
    apartments = [_apartment(seed, params) for seed in params.seeds]
    rows = [
        {"map": name, **_mean([each["rows"][index] for each in apartments])}
        for index, name in enumerate(ROWS)
    ]
    cost = _mean([each["cost"] for each in apartments])
    return {
        "benchmark": "pose_graph",
        "seeds": list(params.seeds),
        "drift": params.drift,
        "yaw_deg_per_m": params.yaw_deg_per_m,
        "rows": rows,
        **cost,
    }


def table_lines(result: dict[str, Any]) -> list[str]:
    """The rows as a table, then what it took."""
    lines = [f"{'':16} wrong occupied  wrong free  similarity off by"]
    for row in result["rows"]:
        occupied, free = 100 * row["wrong_occupied"], 100 * row["wrong_free"]
        lines.append(
            f"{row['map']:16} {occupied:12.1f} %  {free:8.1f} %  "
            f"{row['similarity_error_m']:15.2f} m"
        )
    shown = ("way_m", "end_error_m", "submaps", "submap_kb", "moved", "ms_per_moved")
    return lines + [f"{name:16} {result[name]}" for name in shown]


def _apartment(seed: int, params: PoseGraphBenchParams) -> dict[str, Any]:
    loop = driven_loop(seed, params)
    true_map, _ = mapped(loop, loop.true, params.mapper)
    smeared, _ = mapped(loop, loop.said, params.mapper)
    followed, cost = mapped(loop, loop.said, params.mapper, graph=pose_graph(loop))
    maps = (true_map, smeared, followed)
    if params.out is not None:
        write_picture(params.out / f"pose_graph_{seed}.png", side_by_side(maps))
    answers = [answer_errors_m(loop, belief) for belief in maps]
    known = {name for name, error_m in answers[0].items() if error_m <= KNOWN_WITHIN_M}
    rows = [
        {
            **cell_errors(loop, belief),
            "similarity_error_m": float(np.mean([each[name] for name in known & set(each)])),
        }
        for belief, each in zip(maps, answers, strict=True)
    ]
    last = loop.closed - 1
    way_m = np.linalg.norm(np.diff(loop.true[: loop.closed, :2, 3], axis=0), axis=1).sum()
    error_m = np.linalg.norm(loop.said[last, :2, 3] - loop.true[last, :2, 3])
    return {
        "rows": rows,
        "cost": {
            "way_m": float(way_m),
            "end_error_m": float(error_m),
            "submaps": cost.count,
            "submap_kb": cost.nbytes / max(cost.count, 1) / 1e3,
            "moved": cost.moved,
            "ms_per_moved": cost.total_ms / max(cost.moved, 1),
        },
    }


def driven_loop(seed: int, params: PoseGraphBenchParams) -> DrivenLoop:
    """Drive through a generated apartment and see it, with simulated features."""
    scene = generate_apartment(seed, STYLES["training"])
    lap = loop_drive(scene, PLACES)
    drift = OdometryDrift(params.drift, float(np.radians(params.yaw_deg_per_m)))
    said = drifting(lap, drift)
    again = lap[: int(AGAIN * len(lap))]
    rng = np.random.default_rng((seed, 1))
    encoder = SimulatedEncoder(scene, SHIPPED, FEATURES, rng)
    true = np.concatenate([lap, again])
    corrected = np.concatenate([loop_closed(said, lap[-1]), again])
    fields = seen_fields(scene, encoder, true)
    robot = {"radius_m": 0.2, "height_m": CAMERA.height_m, "eye_height_m": CAMERA.height_m}
    truth = SceneTruth(scene, **robot)
    said = np.concatenate([said, again])
    return DrivenLoop(scene, encoder, fields, true, said, corrected, len(lap), truth)


def seen_fields(scene: Scene, encoder: SimulatedEncoder, poses: F64) -> tuple[FeatureField, ...]:
    """What perception computes at these poses of the body (n, 4, 4), with the true poses."""
    renderer, fields = LabelRenderer(scene), []
    for index, pose in enumerate(poses):
        T = pose @ CAMERA.mount
        view = renderer.render(T, CAMERA.intrinsics, width=CAMERA.width, height=CAMERA.height)
        depth_mm = measured_mm(view.depth_m, CAMERA.min_depth_m, CAMERA.max_depth_m)
        stamp_ns = (index + 1) * FRAME_NS
        frame = RgbdFrame(index, stamp_ns, view.rgb, depth_mm, CAMERA.intrinsics, T)
        features = encoder.encode(view.rgb)
        fields.append(feature_field(frame, features, encoder, VarianceParams()))
    return tuple(fields)


def pose_graph(loop: DrivenLoop) -> PoseGraph:
    """What SLAM publishes when the loop is closed."""
    frames = np.arange(0, loop.closed, KEYFRAME_FRAMES)
    stamps = (frames + 1) * FRAME_NS
    return PoseGraph(1, loop.closed * FRAME_NS, stamps, loop.said[frames], loop.corrected[frames])


def mapped(
    loop: DrivenLoop, poses: F64, config: MapperConfig, *, graph: PoseGraph | None = None
) -> tuple[BeliefMap, MovedSubmaps]:
    """The map of all frames at these poses of the body; the graph arrives with the closure."""
    belief = BeliefMap(config)
    submaps = SubmapStore(belief, config)
    moved, total_s = 0, 0.0
    for index, (seen, pose) in enumerate(zip(loop.fields, poses, strict=True)):
        if graph is not None and index == loop.closed:
            started_s = time.process_time()
            submaps.follow(graph)
            while submaps.move_next():
                moved += 1
            total_s = time.process_time() - started_s
        update = compute_update(_seen_from(seen, pose), config)
        belief.fuse(update)
        if graph is not None:
            submaps.add(update)
    submaps.close()
    return belief, MovedSubmaps(submaps.count, moved, total_s * 1e3, submaps.nbytes)


def _seen_from(seen: FeatureField, pose: F64) -> FeatureField:
    return FeatureField(
        seen.sequence,
        seen.stamp_ns,
        seen.encoder_id,
        seen.text_space,
        seen.features,
        seen.variance,
        seen.depth_mm,
        seen.intrinsics,
        pose @ CAMERA.mount,
    )


def cell_errors(loop: DrivenLoop, belief: BeliefMap) -> dict[str, float]:
    """``wrong_occupied``: share of the occupied cells without an obstacle in it or beside it.

    ``wrong_free``: share of the cells inside of obstacles that are free.
    """
    params = belief.params
    heights = (params.obstacle_min_height_m, params.obstacle_max_height_m)
    grid, states = belief.grid, belief.occupancy_grid()
    centres = grid.centres(np.argwhere(np.ones(grid.shape, bool)))
    raster, touched = occupied_cells(loop.scene, params.cell_size_m, *heights)
    near = _at(raster, dilated(touched), centres).reshape(grid.shape)
    fine_grid, fine = occupied_cells(loop.scene, params.cell_size_m / 2, *heights)
    quarter = params.cell_size_m / 4
    inside = np.ones(grid.shape, bool)
    for dx in (-quarter, quarter):
        for dy in (-quarter, quarter):
            inside &= _at(fine_grid, fine, centres + (dx, dy)).reshape(grid.shape)
    occupied, free = states == Occupancy.OCCUPIED, states == Occupancy.FREE
    return {
        "wrong_occupied": float((occupied & ~near).sum() / max(occupied.sum(), 1)),
        "wrong_free": float((free & inside).sum() / max(inside.sum(), 1)),
    }


def answer_errors_m(loop: DrivenLoop, belief: BeliefMap) -> dict[str, float]:
    """Metres from the middle of the best answer to the nearest such object, for each category."""
    scores, errors = MapScores(belief), dict[str, float]()
    for name in sorted(set(loop.scene.categories) - set(STRUCTURE)):
        query = text_query(loop.encoder.embed_text((name,)), 0, belief.params.torch_device)
        request = SimilarityRequest(name)
        reply = similarity_reply(scores.of([query]), request=request, params=MapperConfig())
        if len(reply.centres_m):
            x, y = (float(value) for value in reply.centres_m[0])
            errors[name] = loop.truth.distances(name, x, y).straight_line_m
    return errors


def _at(grid: GridSpec, mask: Bool, points_m: F64) -> Bool:
    """The mask (nx, ny) at points (n, 2); false outside the grid."""
    cells = grid.cells(points_m)
    inside = grid.contains(cells)
    result = np.zeros(len(points_m), bool)
    result[inside] = mask[tuple(cells[inside].T)]
    return result


def _mean(documents: list[dict[str, float]]) -> dict[str, float]:
    return {
        name: round(float(np.mean([each[name] for each in documents])), 4) for name in documents[0]
    }


def side_by_side(maps: tuple[BeliefMap, ...]) -> U8:
    """The maps in the order of ``ROWS`` as one picture (H, W, 3)."""
    drawn = []
    for name, belief in zip(ROWS, maps, strict=True):
        image = render_map(search_view(MapScores(belief).of([]), text=""), scale=3).image
        bar = np.full((28, image.shape[1], 3), 24, np.uint8)
        cv2.putText(bar, name, (6, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.55, (235, 235, 235), 1)
        drawn.append(np.concatenate([bar, image[..., :3]]))
    height = max(len(image) for image in drawn)
    padded = [np.pad(each, ((0, height - len(each)), (0, 8), (0, 0))) for each in drawn]
    return np.hstack(padded)


def write_picture(file: Path, image: U8) -> None:
    """Write a PNG; ValueError if that fails."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(encode_png(image))
    except OSError as problem:
        raise ValueError(
            f"cannot write to {file.parent}: {problem.strerror or problem}"
        ) from problem
