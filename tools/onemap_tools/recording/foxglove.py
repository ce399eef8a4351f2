"""Messages of the bus as messages of Foxglove. Pure: nothing is sent here.

Frames: ``map``, ``body`` (x forward, y left, z up) and ``camera`` (x right, y down, z forward).
"""

from __future__ import annotations

import numpy as np
from foxglove.messages import (
    ArrowPrimitive,
    CameraCalibration,
    Color,
    CompressedImage,
    CubePrimitive,
    FrameTransform,
    FrameTransforms,
    Grid,
    ImageAnnotations,
    LinePrimitive,
    LinePrimitiveLineType,
    PackedElementField,
    PackedElementFieldNumericType,
    Point2,
    Point3,
    PointCloud,
    PointsAnnotation,
    PointsAnnotationType,
    Pose,
    Quaternion,
    SceneEntity,
    SceneEntityDeletion,
    SceneEntityDeletionType,
    SceneUpdate,
    SpherePrimitive,
    TextAnnotation,
    TextPrimitive,
    Timestamp,
    Vector2,
    Vector3,
)
from scipy.spatial.transform import Rotation

from onemap_gateway.present.palette import DARK, Rgb
from onemap_gateway.present.render import BOX, encode_jpeg
from onemap_shared.camera import unproject
from onemap_shared.geometry import F32, F64, U8
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Detections, KeptObject, Odometry, PlannedPath, RgbdFrame
from onemap_shared.trail import PointM

MAP, BODY, CAMERA = "map", "body", "camera"
SECOND_NS = 10**9
JPEG_QUALITY = 85
CLOUD_STRIDE = 4  # every fourth pixel each way: 19,200 points, 0.3 MB for each frame of 640 x 480
RGBA = ("red", "green", "blue", "alpha")
LABEL_PX = 14.0
OPAQUE = 255

UINT8, FLOAT32 = PackedElementFieldNumericType.Uint8, PackedElementFieldNumericType.Float32


def timestamp(stamp_ns: int) -> Timestamp:
    """Nanoseconds since 1970 as Foxglove writes them."""
    return Timestamp(*divmod(stamp_ns, SECOND_NS))


def color(rgb: Rgb, alpha: float = 1.0) -> Color:
    """A colour of 0 to 255 per channel as one of 0 to 1."""
    red, green, blue = (value / 255 for value in rgb)
    return Color(r=red, g=green, b=blue, a=alpha)


def rotation(T: F64) -> Quaternion:
    """The rotation of a rigid transform (4, 4) as a unit quaternion."""
    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat()
    return Quaternion(x=x, y=y, z=z, w=w)


def transforms(T_map_child: F64, child: str, stamp_ns: int) -> FrameTransforms:
    """Where the body or the camera is in the map."""
    x, y, z = T_map_child[:3, 3]
    transform = FrameTransform(
        timestamp=timestamp(stamp_ns),
        parent_frame_id=MAP,
        child_frame_id=child,
        translation=Vector3(x=x, y=y, z=z),
        rotation=rotation(T_map_child),
    )
    return FrameTransforms(transforms=[transform])


def camera_image(frame: RgbdFrame) -> CompressedImage:
    """The color image as JPEG."""
    return CompressedImage(
        timestamp=timestamp(frame.stamp_ns),
        frame_id=CAMERA,
        data=encode_jpeg(frame.rgb, JPEG_QUALITY),
        format="jpeg",
    )


def calibration(frame: RgbdFrame) -> CameraCalibration:
    """The camera without distortion; pixel centres lie at integers, as OpenCV has them."""
    matrix = frame.intrinsics.matrix()
    height, width = frame.depth_mm.shape
    return CameraCalibration(
        timestamp=timestamp(frame.stamp_ns),
        frame_id=CAMERA,
        width=width,
        height=height,
        K=matrix.ravel().tolist(),
        R=np.eye(3).ravel().tolist(),
        P=np.hstack([matrix, np.zeros((3, 1))]).ravel().tolist(),
    )


def frame_points(frame: RgbdFrame) -> tuple[F32, U8]:
    """Points (N, 3) in metres of the camera frame and their RGB (N, 3), of every fourth pixel."""
    depth_m = frame.depth_mm[::CLOUD_STRIDE, ::CLOUD_STRIDE].astype(np.float32) / np.float32(1000)
    points = unproject(depth_m, frame.intrinsics.strided(CLOUD_STRIDE))
    seen = depth_m > 0
    return points[seen], frame.rgb[::CLOUD_STRIDE, ::CLOUD_STRIDE][seen]


def frame_cloud(frame: RgbdFrame) -> PointCloud:
    """What the camera sees as coloured points."""
    points, colours = frame_points(frame)
    return cloud(points, colours, CAMERA, frame.stamp_ns)


def detected_cloud(detections: Detections) -> PointCloud:
    """The surface points of all detections, in the map."""
    colours = np.broadcast_to(np.array(BOX, np.uint8), (len(detections.points_map), 3))
    return cloud(detections.points_map, colours, MAP, detections.stamp_ns)


def cloud(points: F32, colours: U8, frame_id: str, stamp_ns: int) -> PointCloud:
    """Points (N, 3) in metres with RGB (N, 3)."""
    packed = np.zeros(len(points), dtype=[("xyz", np.float32, 3), ("rgba", np.uint8, 4)])
    packed["xyz"] = points
    packed["rgba"][:, :3], packed["rgba"][:, 3] = colours, OPAQUE
    fields = [PackedElementField(name=n, offset=4 * i, type=FLOAT32) for i, n in enumerate("xyz")]
    fields += [PackedElementField(name=n, offset=12 + i, type=UINT8) for i, n in enumerate(RGBA)]
    return PointCloud(
        timestamp=timestamp(stamp_ns),
        frame_id=frame_id,
        pose=_pose(0.0, 0.0, 0.0),
        point_stride=packed.dtype.itemsize,
        fields=fields,
        data=packed.tobytes(),
    )


def boxes_in_image(detections: Detections) -> ImageAnnotations:
    """A labelled box around each detection, in pixels of the camera image."""
    at = timestamp(detections.stamp_ns)
    boxes, texts = [], []
    for name, score, (x0, y0, x1, y1) in zip(
        detections.names, detections.scores, detections.boxes_px.tolist(), strict=True
    ):
        corners = [Point2(x=x, y=y) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
        boxes.append(
            PointsAnnotation(
                timestamp=at,
                type=PointsAnnotationType.LineLoop,
                points=corners,
                outline_color=color(BOX),
                thickness=2.0,
            )
        )
        texts.append(
            TextAnnotation(
                timestamp=at,
                position=Point2(x=x0, y=y0),
                text=f"{name} {score:.2f}",
                font_size=LABEL_PX,
                text_color=color(BOX),
                background_color=color((0, 0, 0), 0.6),
            )
        )
    return ImageAnnotations(timestamp=at, points=boxes, texts=texts)


def grid(cells: GridSpec, rgba: U8, value: F32, *, stamp_ns: int, height_m: float) -> Grid:
    """A layer of the map: RGBA (nx, ny, 4), and the value of each cell (nx, ny) for inspection.

    ``height_m``: of the layer over the floor, so that layers do not cover each other.
    """
    packed = np.zeros((*cells.shape, 1), dtype=[("rgba", np.uint8, 4), ("value", np.float32)])
    packed["rgba"][..., 0, :] = rgba
    packed["value"][..., 0] = value
    rows = np.ascontiguousarray(packed.swapaxes(0, 1))  # Foxglove's rows follow y
    fields = [PackedElementField(name=n, offset=i, type=UINT8) for i, n in enumerate(RGBA)]
    fields += [PackedElementField(name="value", offset=4, type=FLOAT32)]
    x_min, y_min, _, _ = cells.bounds_m
    return Grid(
        timestamp=timestamp(stamp_ns),
        frame_id=MAP,
        pose=_pose(x_min, y_min, height_m),
        column_count=cells.shape[0],
        cell_size=Vector2(x=cells.cell_size_m, y=cells.cell_size_m),
        row_stride=cells.shape[0] * packed.dtype.itemsize,
        cell_stride=packed.dtype.itemsize,
        fields=fields,
        data=rows.tobytes(),
    )


def _pose(x_m: float, y_m: float, z_m: float) -> Pose:
    return Pose(position=Vector3(x=x_m, y=y_m, z=z_m), orientation=Quaternion(w=1.0))


PATH_Z_M, LABEL_Z_M = 0.05, 0.35  # above the layers of the map; labels above what they name
OBJECT_HEIGHT_M = 0.3  # of a box around the middle of an object whose heights are not known
LABEL_ABOVE_M = 0.2  # the box
ROBOT_LENGTH_M, LINE_M, LABEL_M = 0.4, 0.04, 0.18


def robot_scene(odometry: Odometry, trail_m: tuple[PointM, ...]) -> SceneUpdate:
    """An arrow where the robot is, and the way that it came."""
    arrow = ArrowPrimitive(
        pose=Pose(
            position=_vector(*odometry.T_map_body[:3, 3]), orientation=rotation(odometry.T_map_body)
        ),
        shaft_length=0.6 * ROBOT_LENGTH_M,
        shaft_diameter=0.15,
        head_length=0.4 * ROBOT_LENGTH_M,
        head_diameter=0.28,
        color=color(DARK.robot),
    )
    trail = _line(np.array(trail_m).reshape(-1, 2), "trail", odometry.stamp_ns)
    return SceneUpdate(entities=[_entity("robot", odometry.stamp_ns, arrows=[arrow]), trail])


def plan_scene(plan: PlannedPath) -> SceneUpdate:
    """Path, goal, frontiers and regions, each sized by its score; an empty plan clears them."""
    stamp_ns = plan.stamp_ns
    goals = [_sphere(x, y, 0.25, "path") for x, y in plan.goal_m.tolist()]
    labels = [_text(plan.goal_kind, x, y, LABEL_Z_M, "path") for x, y in plan.goal_m.tolist()]
    return SceneUpdate(
        entities=[
            _line(plan.points_m, "path", stamp_ns),
            _entity("goal", stamp_ns, spheres=goals, texts=labels),
            _entity(
                "frontiers",
                stamp_ns,
                spheres=_scored(plan.frontiers_m, plan.frontier_scores, "frontier"),
            ),
            _entity(
                "regions", stamp_ns, spheres=_scored(plan.regions_m, plan.region_scores, "region")
            ),
        ]
    )


def object_scene(objects: tuple[KeptObject, ...], stamp_ns: int) -> SceneUpdate:
    """A box and a name for every found object; those that are gone disappear.

    A box has the heights that the object has, where the map knows them.
    """
    entities = []
    for kept in objects:
        x_min, y_min, x_max, y_max = kept.extent_m
        x, y, z = kept.position_m
        half_m = OBJECT_HEIGHT_M / 2
        low, high = kept.height_m or (z - half_m, z + half_m)
        middle = ((x_min + x_max) / 2, (y_min + y_max) / 2, (low + high) / 2)
        box = CubePrimitive(
            pose=Pose(position=_vector(*middle), orientation=Quaternion(w=1.0)),
            size=_vector(x_max - x_min, y_max - y_min, high - low),
            color=color(DARK.found, 0.55),
        )
        label = _text(f"{kept.name} {kept.score:.2f}", x, y, high + LABEL_ABOVE_M, "found")
        entities.append(_entity(kept.object_id, stamp_ns, cubes=[box], texts=[label]))
    deletion = SceneEntityDeletion(timestamp=timestamp(stamp_ns), type=SceneEntityDeletionType.All)
    return SceneUpdate(deletions=[deletion], entities=entities)


def _scored(points_m: F32, scores: F32, paint: str) -> list[SpherePrimitive]:
    sizes = 0.12 + 0.2 * np.clip(np.nan_to_num(scores), 0, 1)
    return [
        _sphere(x, y, size, paint)
        for (x, y), size in zip(points_m.tolist(), sizes.tolist(), strict=True)
    ]


def _entity(name: str, stamp_ns: int, **primitives: object) -> SceneEntity:
    return SceneEntity(
        timestamp=timestamp(stamp_ns),
        frame_id=MAP,
        id=name,
        **primitives,  # type: ignore[arg-type]
    )


def _line(points_m: F32 | F64, paint: str, stamp_ns: int) -> SceneEntity:
    """A line of this colour of the palette through points (N, 2); the entity has its name."""
    points = [Point3(x=x, y=y, z=PATH_Z_M) for x, y in points_m.tolist()]
    line = LinePrimitive(
        type=LinePrimitiveLineType.LineStrip,
        pose=Pose(position=_vector(0.0, 0.0, 0.0), orientation=Quaternion(w=1.0)),
        thickness=LINE_M,
        points=points,
        color=color(getattr(DARK, paint)),
    )
    return _entity(paint, stamp_ns, lines=[line])


def _sphere(x_m: float, y_m: float, size_m: float, paint: str) -> SpherePrimitive:
    return SpherePrimitive(
        pose=Pose(position=_vector(x_m, y_m, PATH_Z_M), orientation=Quaternion(w=1.0)),
        size=_vector(size_m, size_m, size_m),
        color=color(getattr(DARK, paint), 0.9),
    )


def _text(text: str, x_m: float, y_m: float, z_m: float, paint: str) -> TextPrimitive:
    return TextPrimitive(
        pose=Pose(position=_vector(x_m, y_m, z_m), orientation=Quaternion(w=1.0)),
        billboard=True,
        font_size=LABEL_M,
        color=color(getattr(DARK, paint)),
        text=text,
    )


def _vector(x: float, y: float, z: float) -> Vector3:
    return Vector3(x=float(x), y=float(y), z=float(z))
