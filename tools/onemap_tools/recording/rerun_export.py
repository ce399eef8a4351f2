"""``onemap export rerun``: a recording as a file for Rerun's viewer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from onemap_gateway.present.palette import DARK
from onemap_gateway.present.render import BOX, encode_jpeg
from onemap_shared.camera import unproject_to_map
from onemap_shared.geometry import F32, F64
from onemap_shared.messages import (
    Detections,
    Heartbeat,
    MapRevision,
    Odometry,
    PlannedPath,
    RgbdFrame,
    SearchState,
    SearchStatus,
    SearchView,
    VelocityCommand,
)
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.recording.bag_file import FRAMES, RECORDED, VIEWS, BagError, BagMessage, BagReader
from onemap_tools.recording.map_colours import belief_rgba, occupancy_rgba, similarity_rgba

Entity: TypeAlias = tuple[str, Any]

WORLD, CAMERA, IMAGE = "world", "world/camera", "world/camera/image"
JPEG_QUALITY = 85
CLOUD_STRIDE = 4  # every fourth pixel each way
PATH_Z_M, LAYER_M, ROBOT_M = 0.05, 0.01, (0.4, 0.3, 0.3)
FRUSTUM_M = 0.5  # where the image hangs in front of the camera
RECORDED_AT, CAPTURED_AT = "recorded", "captured"  # by the recorder's clock, by the message's own


def entities_of(message: object) -> Iterator[Entity]:
    """What a message shows; nothing for those that have no picture."""
    show = SHOWN.get(type(message))
    if show is not None:
        yield from show(message)


def _placed(T: F64) -> Any:
    return rr.Transform3D(translation=T[:3, 3], mat3x3=T[:3, :3])


def _frame(frame: RgbdFrame) -> Iterator[Entity]:
    height, width = frame.depth_mm.shape
    yield CAMERA, _placed(frame.T_map_camera)
    camera = rr.Pinhole(
        image_from_camera=frame.intrinsics.matrix(),
        resolution=(width, height),
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=FRUSTUM_M,
    )
    yield IMAGE, camera
    jpeg = encode_jpeg(frame.rgb, JPEG_QUALITY)
    yield IMAGE, rr.EncodedImage(contents=jpeg, media_type="image/jpeg")
    step = CLOUD_STRIDE
    depth_m = frame.depth_mm[::step, ::step].astype(np.float32) / np.float32(1000)
    points = unproject_to_map(depth_m, frame.intrinsics.strided(step), frame.T_map_camera)
    seen = depth_m > 0
    yield "world/points", rr.Points3D(points[seen], colors=frame.rgb[::step, ::step][seen])


def _odometry(odometry: Odometry) -> Iterator[Entity]:
    yield "world/robot", _placed(odometry.T_map_body)
    body = rr.Boxes3D(sizes=[ROBOT_M], centers=[(0, 0, ROBOT_M[2] / 2)], colors=[DARK.robot])
    yield "world/robot/body", body
    yield "plots/speed/forwards", rr.Scalars(odometry.linear_mps)
    yield "plots/speed/turning", rr.Scalars(odometry.angular_radps)


def _command(command: VelocityCommand) -> Iterator[Entity]:
    yield "plots/speed/commanded", rr.Scalars(command.linear_mps)
    yield "plots/speed/commanded_turning", rr.Scalars(command.angular_radps)


def _detections(detections: Detections) -> Iterator[Entity]:
    found = zip(detections.names, detections.scores, strict=True)
    labels = [f"{name} {score:.2f}" for name, score in found]
    boxes = rr.Boxes2D(
        array=detections.boxes_px,
        array_format=rr.Box2DFormat.XYXY,
        labels=labels,
        colors=[BOX] * len(labels),
    )
    yield f"{IMAGE}/boxes", boxes
    yield "world/detected", rr.Points3D(detections.points_map, colors=BOX, radii=0.02)


def _view(view: SearchView) -> Iterator[Entity]:
    """The layers as images, row 0 with the largest y, at their lower left corner."""
    if not view.occupancy.size:
        return
    layers = {"occupancy": occupancy_rgba(view.occupancy), "belief": belief_rgba(view.layers)}
    if view.similarity.size:
        layers["similarity"] = similarity_rgba(view.similarity)
    width, height = view.grid.shape
    x_min, y_min, _, _ = view.grid.bounds_m
    form = rr.components.ImageFormat(
        width=width, height=height, color_model="RGBA", channel_datatype="U8"
    )
    for index, (name, rgba) in enumerate(layers.items()):
        image = rr.GridMap(
            data=np.ascontiguousarray(rgba.swapaxes(0, 1)[::-1]).tobytes(),
            format=form,
            cell_size=view.grid.cell_size_m,
            translation=(x_min, y_min, LAYER_M * index),
        )
        yield f"world/map/{name}", image


def _revision(revision: MapRevision) -> Iterator[Entity]:
    yield "plots/map/update_ms", rr.Scalars(revision.update_ms)
    yield "plots/map/frames_per_s", rr.Scalars(revision.rate_hz)


def _plan(plan: PlannedPath) -> Iterator[Entity]:
    path, goal = _lifted(plan.points_m), _lifted(plan.goal_m)
    yield "world/plan/path", rr.LineStrips3D([path], colors=[DARK.path], radii=0.02)
    labels = [plan.goal_kind] * len(goal)
    yield "world/plan/goal", rr.Points3D(goal, colors=DARK.path, radii=0.12, labels=labels)
    for name, points, scores, colour in (
        ("frontiers", plan.frontiers_m, plan.frontier_scores, DARK.frontier),
        ("regions", plan.regions_m, plan.region_scores, DARK.region),
    ):
        radii = 0.06 + 0.1 * np.clip(np.nan_to_num(scores), 0, 1)
        yield f"world/plan/{name}", rr.Points3D(_lifted(points), colors=colour, radii=radii)


def _lifted(points_m: F32) -> F32:
    """Points (N, 2) of the floor as (N, 3) a little above it."""
    lifted: F32 = np.pad(points_m, ((0, 0), (0, 1)), constant_values=PATH_Z_M)
    return lifted


def _search(status: SearchStatus) -> Iterator[Entity]:
    found = [
        result
        for result in status.results
        if result.outcome is SearchState.FOUND and len(result.position_m) == 3
    ]
    labels = [f"{result.name} {result.score:.2f}" for result in found]
    places = [result.position_m for result in found]
    yield "world/objects", rr.Points3D(places, labels=labels, colors=DARK.found, radii=0.12)
    yield "log/search", rr.TextLog(f"{status.state}: {status.reason}", level="INFO")


def _heartbeat(beat: Heartbeat) -> Iterator[Entity]:
    for name, value in sorted(beat.metrics.items()):
        if name.endswith("_ms"):
            yield f"plots/times/{beat.service}_{name}", rr.Scalars(value)
    if beat.problem:
        yield f"log/{beat.service}", rr.TextLog(beat.problem, level="WARN")


SHOWN: dict[type, Callable[[Any], Iterator[Entity]]] = {
    RgbdFrame: _frame,
    Odometry: _odometry,
    VelocityCommand: _command,
    Detections: _detections,
    SearchView: _view,
    MapRevision: _revision,
    PlannedPath: _plan,
    SearchStatus: _search,
    Heartbeat: _heartbeat,
}
TYPES = {topic.key: topic.message for topic in (*(topic for topic, _ in RECORDED), VIEWS)}


def export(path: Path, out: Path) -> dict[str, Any]:
    """Write ``out``; returns counts. CliError for what cannot be read or written."""
    if out.exists():
        raise CliError(f"{out} exists: choose another name, or remove it.", EXIT_USAGE_ERROR)
    stream = rr.RecordingStream("onemap", recording_id=path.stem)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        stream.save(out, default_blueprint=blueprint())
    except (OSError, RuntimeError) as problem:
        raise CliError(f"Cannot write {out}: {problem}.") from problem
    reader, counts = BagReader(path), Counter[str]()
    stream.log(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    try:
        for message in reader.messages():
            counts[message.topic] += _log(stream, message)
    except BagError:
        stream.disconnect()
        out.unlink()
        raise
    finally:
        stream.flush()
        stream.disconnect()
    lacking = [
        what
        for what, topic in (("snapshots of the map", VIEWS), ("images", FRAMES))
        if not counts[topic.key]
    ]
    return {
        "file": str(out),
        "bytes": out.stat().st_size,
        "cut_off": reader.cut_off,
        "messages": {topic: count for topic, count in sorted(counts.items()) if count},
        "problems": [f"The recording holds no {what}, so that none is shown." for what in lacking],
    }


def _log(stream: rr.RecordingStream, message: BagMessage) -> int:
    """Log what a message shows; 1 if it shows anything."""
    beat = message.schema.startswith(f"onemap.{Heartbeat.__name__}/")  # one key for each service
    kind = Heartbeat if beat else TYPES.get(message.topic)
    if kind not in SHOWN:
        return 0
    stream.set_time(RECORDED_AT, timestamp=np.datetime64(message.log_time_ns, "ns"))
    stream.set_time(CAPTURED_AT, timestamp=np.datetime64(message.stamp_ns, "ns"))
    for entity, archetype in entities_of(message.decode(kind)):
        stream.log(entity, archetype)
    return 1


def blueprint() -> rrb.Blueprint:
    """The layout with which the file opens: the map, the camera, plots and the log."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(origin=WORLD, name="Map"),
            rrb.Vertical(
                rrb.Spatial2DView(origin=IMAGE, name="Camera"),
                rrb.TimeSeriesView(origin="plots/speed", name="Speed, m/s and rad/s"),
                rrb.TimeSeriesView(origin="plots/times", name="Times, ms"),
                rrb.TextLogView(origin="log", name="Log"),
                row_shares=[3, 2, 2, 2],
            ),
            column_shares=[3, 2],
        ),
        rrb.TimePanel(timeline=RECORDED_AT, state="collapsed"),
        collapse_panels=True,
    )


def describe(document: dict[str, Any]) -> list[str]:
    """The same for people, line by line."""
    lines = [
        f"{document['file']}: {document['bytes'] / 1e6:.1f} MB of "
        f"{sum(document['messages'].values())} messages. Open it: rerun --bind 127.0.0.1 "
        f"{document['file']}"
    ]
    if document["cut_off"]:
        lines.append("The recording was cut off; what was there is in it.")
    return [*lines, *document["problems"]]
