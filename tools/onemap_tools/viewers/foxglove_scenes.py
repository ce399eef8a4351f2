"""Plans, regions and objects as entities of a Foxglove scene. Pure: nothing is sent here."""

from __future__ import annotations

import numpy as np
from foxglove.messages import (
    ArrowPrimitive,
    CubePrimitive,
    LinePrimitive,
    LinePrimitiveLineType,
    Point3,
    Pose,
    Quaternion,
    SceneEntity,
    SceneEntityDeletion,
    SceneEntityDeletionType,
    SceneUpdate,
    SpherePrimitive,
    TextPrimitive,
    Vector3,
)

from onemap_gateway.present.palette import DARK
from onemap_shared.geometry import F32, F64
from onemap_shared.messages import KeptObject, Odometry, PlannedPath
from onemap_shared.trail import PointM
from onemap_tools.viewers.foxglove_messages import MAP, color, rotation, timestamp

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
