"""Finds, regions and frontiers as ``visualization_msgs/MarkerArray``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from onemap_ros2.cdr import encode, header, new
from onemap_ros2.ros_types import MARKER_ARRAY
from onemap_shared.geometry import F32
from onemap_shared.messages import KeptObject, PlannedPath

MARKER, POINT = "visualization_msgs/msg/Marker", "geometry_msgs/msg/Point"
CYLINDER, SPHERE, SPHERE_LIST, TEXT, DELETE_ALL = 3, 2, 7, 9, 3
FIND_M, REGION_M, FRONTIER_M, LETTER_M = 0.25, 0.4, 0.15, 0.25
LABEL_ABOVE_M = 0.35
MAX_MARKED = 300  # frontiers of a hall: RViz draws them as one list
FIND_COLOR = (0.1, 0.75, 0.2, 1.0)
FRONTIER_COLOR = (0.1, 0.5, 1.0, 0.8)
REGION_COLOR = (1.0, 0.55, 0.0)
Place = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Mark:
    """What one marker shows: names, places in metres of the map frame, size in metres, RGBA."""

    namespace: str
    number: int
    kind: int
    place: Place = (0.0, 0.0, 0.0)
    size: Place = (1.0, 1.0, 1.0)
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    text: str = ""
    points: tuple[Place, ...] = ()
    action: int = 0


def marker_array(
    objects: Iterable[KeptObject], path: PlannedPath | None, stamp_ns: int, frame: str
) -> bytes:
    """All markers; those of the message before are deleted first.

    Namespaces: finds (a sphere and its name), regions (a disc, the fainter the lower its score)
    and frontiers (spheres in one list).
    """
    marks = [Mark("", 0, SPHERE, action=DELETE_ALL)]
    for number, kept in enumerate(objects):
        marks += _find(number, kept)
    if path is not None:
        scored = zip(path.regions_m[:MAX_MARKED], path.region_scores, strict=False)
        marks += [_region(n, place, float(score)) for n, (place, score) in enumerate(scored)]
        if len(path.frontiers_m):
            marks.append(_frontiers(path.frontiers_m[:MAX_MARKED]))
    head = header(stamp_ns, frame)
    return encode(new(MARKER_ARRAY, [_marker(head, mark) for mark in marks]), MARKER_ARRAY)


def _find(number: int, kept: KeptObject) -> list[Mark]:
    x, y, z = kept.position_m
    size = (LETTER_M, LETTER_M, LETTER_M)
    label = Mark("finds", 2 * number + 1, TEXT, (x, y, z + LABEL_ABOVE_M), size, text=kept.name)
    size = (FIND_M, FIND_M, FIND_M)
    return [Mark("finds", 2 * number, SPHERE, (x, y, z), size, FIND_COLOR), label]


def _region(number: int, place: F32, score: float) -> Mark:
    color = (*REGION_COLOR, 0.2 + 0.7 * min(max(score, 0.0), 1.0))
    x, y = (float(value) for value in place)
    return Mark("regions", number, CYLINDER, (x, y, 0.0), (REGION_M, REGION_M, 0.05), color)


def _frontiers(places: F32) -> Mark:
    size = (FRONTIER_M, FRONTIER_M, FRONTIER_M)
    points = tuple((float(x), float(y), 0.0) for x, y in places)
    return Mark("frontiers", 0, SPHERE_LIST, size=size, color=FRONTIER_COLOR, points=points)


def _marker(head: object, mark: Mark) -> object:
    identity = new("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0)
    place, nothing = new(POINT, *mark.place), np.zeros(0, np.uint8)
    return new(
        MARKER,
        head,
        mark.namespace,
        mark.number,
        mark.kind,
        mark.action,
        new("geometry_msgs/msg/Pose", place, identity),
        new("geometry_msgs/msg/Vector3", *mark.size),
        new("std_msgs/msg/ColorRGBA", *mark.color),
        new("builtin_interfaces/msg/Duration", 0, 0),  # it stays
        False,
        [new(POINT, *point) for point in mark.points],
        [],
        "",
        new("sensor_msgs/msg/CompressedImage", header(0, ""), "", nothing),
        [],
        mark.text,
        "",
        new("visualization_msgs/msg/MeshFile", "", nothing),
        False,
    )
