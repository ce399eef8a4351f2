"""Messages of the bus as messages of Foxglove. Pure: nothing is sent here.

Frames: ``map``, ``body`` (x forward, y left, z up) and ``camera`` (x right, y down, z forward).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from foxglove import messages as fox
from scipy.spatial.transform import Rotation

from onemap_gateway.present.palette import DARK, Rgb
from onemap_gateway.present.render import BOX, encode_jpeg
from onemap_shared.camera import unproject
from onemap_shared.geometry import F32, F64, U8
from onemap_shared.grid import GridSpec
from onemap_shared.messages import (
    Detections,
    Heartbeat,
    KeptObject,
    MapRevision,
    Odometry,
    PlannedPath,
    RgbdFrame,
    SearchStatus,
    VelocityCommand,
)
from onemap_shared.trail import PointM

MAP, BODY, CAMERA = "map", "body", "camera"
JPEG_QUALITY = 85
CLOUD_STRIDE = 4  # every fourth pixel each way: 19,200 points, 0.3 MB for each frame of 640 x 480
LABEL_PX = 14.0
PATH_Z_M, LABEL_Z_M = 0.05, 0.35  # above the layers of the map; labels above what they name
OBJECT_HEIGHT_M = 0.3  # of a box around the middle of an object whose heights are not known
LABEL_ABOVE_M = 0.2  # the box
ROBOT_LENGTH_M, LINE_M, LABEL_M = 0.4, 0.04, 0.18

UINT8, FLOAT32 = fox.PackedElementFieldNumericType.Uint8, fox.PackedElementFieldNumericType.Float32
RGBA = ("red", "green", "blue", "alpha")
UPRIGHT = fox.Quaternion(w=1.0)


def _at(stamp_ns: int) -> fox.Timestamp:
    return fox.Timestamp(*divmod(stamp_ns, 10**9))


def _color(rgb: Rgb, alpha: float = 1.0) -> fox.Color:
    red, green, blue = (value / 255 for value in rgb)
    return fox.Color(r=red, g=green, b=blue, a=alpha)


def _rotation(T: F64) -> fox.Quaternion:
    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat()
    return fox.Quaternion(x=x, y=y, z=z, w=w)


def _vector(x: float, y: float, z: float) -> fox.Vector3:
    return fox.Vector3(x=float(x), y=float(y), z=float(z))


def _pose(x_m: float, y_m: float, z_m: float, turn: fox.Quaternion = UPRIGHT) -> fox.Pose:
    return fox.Pose(position=_vector(x_m, y_m, z_m), orientation=turn)


def _field(
    name: str, offset: int, kind: fox.PackedElementFieldNumericType
) -> fox.PackedElementField:
    return fox.PackedElementField(name=name, offset=offset, type=kind)


def transforms(T_map_child: F64, child: str, stamp_ns: int) -> fox.FrameTransforms:
    """Where the body or the camera is in the map."""
    transform = fox.FrameTransform(
        timestamp=_at(stamp_ns),
        parent_frame_id=MAP,
        child_frame_id=child,
        translation=_vector(*T_map_child[:3, 3]),
        rotation=_rotation(T_map_child),
    )
    return fox.FrameTransforms(transforms=[transform])


def camera_image(frame: RgbdFrame) -> fox.CompressedImage:
    """The color image as JPEG."""
    jpeg = encode_jpeg(frame.rgb, JPEG_QUALITY)
    return fox.CompressedImage(
        timestamp=_at(frame.stamp_ns), frame_id=CAMERA, data=jpeg, format="jpeg"
    )


def calibration(frame: RgbdFrame) -> fox.CameraCalibration:
    """The camera without distortion; pixel centres lie at integers, as OpenCV has them."""
    matrix = frame.intrinsics.matrix()
    height, width = frame.depth_mm.shape
    return fox.CameraCalibration(
        timestamp=_at(frame.stamp_ns),
        frame_id=CAMERA,
        width=width,
        height=height,
        K=matrix.ravel().tolist(),
        R=np.eye(3).ravel().tolist(),
        P=np.hstack([matrix, np.zeros((3, 1))]).ravel().tolist(),
    )


def frame_cloud(frame: RgbdFrame) -> fox.PointCloud:
    """What the camera sees as coloured points, in its own frame, of every fourth pixel."""
    depth_m = frame.depth_mm[::CLOUD_STRIDE, ::CLOUD_STRIDE].astype(np.float32) / np.float32(1000)
    points = unproject(depth_m, frame.intrinsics.strided(CLOUD_STRIDE))
    seen = depth_m > 0
    colours = frame.rgb[::CLOUD_STRIDE, ::CLOUD_STRIDE][seen]
    return _cloud(points[seen], colours, CAMERA, frame.stamp_ns)


def detected_cloud(detections: Detections) -> fox.PointCloud:
    """The surface points of all detections, in the map."""
    return _cloud(detections.points_map, np.array(BOX, np.uint8), MAP, detections.stamp_ns)


def _cloud(points: F32, colours: U8, frame_id: str, stamp_ns: int) -> fox.PointCloud:
    """Points (N, 3) in metres with RGB (N, 3) or (3,)."""
    packed = np.zeros(len(points), dtype=[("xyz", np.float32, 3), ("rgba", np.uint8, 4)])
    packed["xyz"] = points
    packed["rgba"][:, :3], packed["rgba"][:, 3] = colours, 255
    fields = [_field(name, 4 * i, FLOAT32) for i, name in enumerate("xyz")]
    fields += [_field(name, 12 + i, UINT8) for i, name in enumerate(RGBA)]
    return fox.PointCloud(
        timestamp=_at(stamp_ns),
        frame_id=frame_id,
        pose=_pose(0.0, 0.0, 0.0),
        point_stride=packed.dtype.itemsize,
        fields=fields,
        data=packed.tobytes(),
    )


def boxes_in_image(detections: Detections) -> fox.ImageAnnotations:
    """A labelled box around each detection, in pixels of the camera image."""
    at = _at(detections.stamp_ns)
    boxes, texts = [], []
    for name, score, (x0, y0, x1, y1) in zip(
        detections.names, detections.scores, detections.boxes_px.tolist(), strict=True
    ):
        corners = [fox.Point2(x=x, y=y) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
        boxes.append(
            fox.PointsAnnotation(
                timestamp=at,
                type=fox.PointsAnnotationType.LineLoop,
                points=corners,
                outline_color=_color(BOX),
                thickness=2.0,
            )
        )
        texts.append(
            fox.TextAnnotation(
                timestamp=at,
                position=corners[0],
                text=f"{name} {score:.2f}",
                font_size=LABEL_PX,
                text_color=_color(BOX),
                background_color=_color((0, 0, 0), 0.6),
            )
        )
    return fox.ImageAnnotations(timestamp=at, points=boxes, texts=texts)


def grid(cells: GridSpec, rgba: U8, value: F32, *, stamp_ns: int, height_m: float) -> fox.Grid:
    """A layer of the map: RGBA (nx, ny, 4), and the value of each cell (nx, ny) for inspection.

    ``height_m``: of the layer over the floor, so that layers do not cover each other.
    """
    packed = np.zeros((*cells.shape, 1), dtype=[("rgba", np.uint8, 4), ("value", np.float32)])
    packed["rgba"][..., 0, :] = rgba
    packed["value"][..., 0] = value
    rows = np.ascontiguousarray(packed.swapaxes(0, 1))  # Foxglove's rows follow y
    fields = [_field(name, i, UINT8) for i, name in enumerate(RGBA)]
    x_min, y_min, _, _ = cells.bounds_m
    return fox.Grid(
        timestamp=_at(stamp_ns),
        frame_id=MAP,
        pose=_pose(x_min, y_min, height_m),
        column_count=cells.shape[0],
        cell_size=fox.Vector2(x=cells.cell_size_m, y=cells.cell_size_m),
        row_stride=cells.shape[0] * packed.dtype.itemsize,
        cell_stride=packed.dtype.itemsize,
        fields=[*fields, _field("value", 4, FLOAT32)],
        data=rows.tobytes(),
    )


def robot_scene(odometry: Odometry, trail_m: tuple[PointM, ...]) -> fox.SceneUpdate:
    """An arrow where the robot is, and the way that it came."""
    x, y, z = odometry.T_map_body[:3, 3]
    arrow = fox.ArrowPrimitive(
        pose=_pose(x, y, z, _rotation(odometry.T_map_body)),
        shaft_length=0.6 * ROBOT_LENGTH_M,
        shaft_diameter=0.15,
        head_length=0.4 * ROBOT_LENGTH_M,
        head_diameter=0.28,
        color=_color(DARK.robot),
    )
    trail = _line(np.array(trail_m).reshape(-1, 2), "trail", odometry.stamp_ns)
    return fox.SceneUpdate(entities=[_entity("robot", odometry.stamp_ns, arrows=[arrow]), trail])


def plan_scene(plan: PlannedPath) -> fox.SceneUpdate:
    """Path, goal, frontiers and regions, each sized by its score; an empty plan clears them."""
    stamp_ns, goals = plan.stamp_ns, plan.goal_m.tolist()
    spheres = {
        "frontiers": _scored(plan.frontiers_m, plan.frontier_scores, "frontier"),
        "regions": _scored(plan.regions_m, plan.region_scores, "region"),
    }
    goal = _entity(
        "goal",
        stamp_ns,
        spheres=[_sphere(x, y, 0.25, "path") for x, y in goals],
        texts=[_text(plan.goal_kind, x, y, LABEL_Z_M, "path") for x, y in goals],
    )
    scored = [_entity(name, stamp_ns, spheres=each) for name, each in spheres.items()]
    return fox.SceneUpdate(entities=[_line(plan.points_m, "path", stamp_ns), goal, *scored])


def object_scene(objects: tuple[KeptObject, ...], stamp_ns: int) -> fox.SceneUpdate:
    """A box and a name for every found object; those that are gone disappear.

    A box has the heights that the object has, where the map knows them.
    """
    entities = []
    for kept in objects:
        x_min, y_min, x_max, y_max = kept.extent_m
        x, y, z = kept.position_m
        half_m = OBJECT_HEIGHT_M / 2
        low, high = kept.height_m or (z - half_m, z + half_m)
        box = fox.CubePrimitive(
            pose=_pose((x_min + x_max) / 2, (y_min + y_max) / 2, (low + high) / 2),
            size=_vector(x_max - x_min, y_max - y_min, high - low),
            color=_color(DARK.found, 0.55),
        )
        label = _text(f"{kept.name} {kept.score:.2f}", x, y, high + LABEL_ABOVE_M, "found")
        entities.append(_entity(kept.object_id, stamp_ns, cubes=[box], texts=[label]))
    every = fox.SceneEntityDeletionType.All
    deletion = fox.SceneEntityDeletion(timestamp=_at(stamp_ns), type=every)
    return fox.SceneUpdate(deletions=[deletion], entities=entities)


def _scored(points_m: F32, scores: F32, paint: str) -> list[fox.SpherePrimitive]:
    sizes = 0.12 + 0.2 * np.clip(np.nan_to_num(scores), 0, 1)
    placed = zip(points_m.tolist(), sizes.tolist(), strict=True)
    return [_sphere(x, y, size, paint) for (x, y), size in placed]


def _entity(name: str, stamp_ns: int, **primitives: Any) -> fox.SceneEntity:
    return fox.SceneEntity(timestamp=_at(stamp_ns), frame_id=MAP, id=name, **primitives)


def _line(points_m: F32 | F64, paint: str, stamp_ns: int) -> fox.SceneEntity:
    """A line of this colour of the palette through points (N, 2); the entity has its name."""
    line = fox.LinePrimitive(
        type=fox.LinePrimitiveLineType.LineStrip,
        pose=_pose(0.0, 0.0, 0.0),
        thickness=LINE_M,
        points=[fox.Point3(x=x, y=y, z=PATH_Z_M) for x, y in points_m.tolist()],
        color=_color(getattr(DARK, paint)),
    )
    return _entity(paint, stamp_ns, lines=[line])


def _sphere(x_m: float, y_m: float, size_m: float, paint: str) -> fox.SpherePrimitive:
    size, color = _vector(size_m, size_m, size_m), _color(getattr(DARK, paint), 0.9)
    return fox.SpherePrimitive(pose=_pose(x_m, y_m, PATH_Z_M), size=size, color=color)


def _text(text: str, x_m: float, y_m: float, z_m: float, paint: str) -> fox.TextPrimitive:
    return fox.TextPrimitive(
        pose=_pose(x_m, y_m, z_m),
        billboard=True,
        font_size=LABEL_M,
        color=_color(getattr(DARK, paint)),
        text=text,
    )


def speed(message: Odometry | VelocityCommand) -> dict[str, Any]:
    """What ``/motion`` and ``/command`` show."""
    return {"linear_mps": message.linear_mps, "angular_radps": message.angular_radps}


def map_state(revision: MapRevision, now_ns: int) -> dict[str, Any]:
    """What ``/map/state`` shows; the age compares the robot's clock with this machine's."""
    names = ("revision", "frames_fused", "cells_observed", "update_ms", "rate_hz")
    age_s = max(now_ns - revision.stamp_ns, 0) / 1e9
    return {**{name: getattr(revision, name) for name in names}, "age_s": age_s}


def search_state(status: SearchStatus) -> dict[str, Any]:
    """What ``/search`` shows."""
    return {
        "search_id": status.search_id,
        "state": str(status.state),
        "target": status.target,
        "reason": status.reason,
        "found": sum(bool(result.position_m) for result in status.results),
        "path_length_m": status.path_length_m,
    }


def service_state(beat: Heartbeat) -> dict[str, Any]:
    """What the topic of a service shows."""
    return {"ready": beat.ready, "problem": beat.problem, "metrics": dict(beat.metrics)}


def log_line(name: str, text: str, stamp_ns: int, *, problem: bool = False) -> fox.Log:
    """A line of the log."""
    level = fox.LogLevel.Warning if problem else fox.LogLevel.Info
    return fox.Log(timestamp=_at(stamp_ns), level=level, message=text, name=name)
