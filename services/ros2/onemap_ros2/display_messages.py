"""What RViz and Foxglove show, as messages: grids, finds, regions, frontiers, the path."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onemap_ros2.cdr import DETECTION_ARRAY, GRID, MARKER_ARRAY, PATH, encode, header, new, time_of
from onemap_ros2.drive.driver import GoalPose, stamped_pose
from onemap_shared.geometry import F32
from onemap_shared.messages import KeptObject, Layer, Occupancy, PlannedPath, SearchView

UNKNOWN, FREE, UNEXPLORED, OCCUPIED = -1, 0, 30, 100  # 30: free, and not looked at well enough


def belief_grid(view: SearchView, frame: str) -> bytes:
    """What is known of each cell: -1 nothing, 0 free and explored, 30 free, 100 occupied."""
    free, explored = view.occupancy == Occupancy.FREE, (view.layers & Layer.EXPLORED) > 0
    values = np.full(view.grid.shape, UNKNOWN, np.int8)
    values[free] = UNEXPLORED
    values[free & explored] = FREE
    values[view.occupancy == Occupancy.OCCUPIED] = OCCUPIED
    return _grid(view, values, frame)


def similarity_grid(view: SearchView, frame: str) -> bytes:
    """The similarity to the object in percent, -1 where nothing was observed or none is sought."""
    values = np.full(view.grid.shape, UNKNOWN, np.int8)
    if view.similarity.shape == view.grid.shape:
        observed = ((view.layers & Layer.OBSERVED) > 0) & np.isfinite(view.similarity)
        percent = np.rint(np.clip(view.similarity[observed], 0.0, 1.0) * 100.0)
        values[observed] = percent.astype(np.int8)
    return _grid(view, values, frame)


def _grid(view: SearchView, values: NDArray[np.int8], frame: str) -> bytes:
    """``values`` (nx, ny) as a grid whose rows follow y, the lowest first."""
    x_m, y_m, *_ = view.grid.bounds_m
    (width, height), size_m = view.grid.shape, view.grid.cell_size_m
    origin = new(
        "geometry_msgs/msg/Pose",
        new("geometry_msgs/msg/Point", x_m, y_m, 0.0),
        new("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0),
    )
    info = new("nav_msgs/msg/MapMetaData", time_of(view.stamp_ns), size_m, width, height, origin)
    return encode(new(GRID, header(view.stamp_ns, frame), info, values.T.ravel()), GRID)


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


def detection_array(objects: Iterable[KeptObject], stamp_ns: int, frame: str) -> bytes:
    """One detection per kept object, with its id, name and score.

    The box has the extent of the cells that the object was seen on, and its heights. Where the map
    does not know them, the box is flat, at the middle of the object.
    """
    head = header(stamp_ns, frame)
    found = [_detection(head, kept) for kept in objects]
    return encode(new(DETECTION_ARRAY, head, found), DETECTION_ARRAY)


def _detection(head: object, kept: KeptObject) -> object:
    x0, y0, x1, y1 = kept.extent_m
    x, y, z = kept.position_m
    low, high = kept.height_m or (z, z)
    hypothesis = new("vision_msgs/msg/ObjectHypothesis", kept.name, kept.score)
    seen = new("geometry_msgs/msg/PoseWithCovariance", _pose(x, y, z), np.zeros(36))
    result = new("vision_msgs/msg/ObjectHypothesisWithPose", hypothesis, seen)
    size = new("geometry_msgs/msg/Vector3", x1 - x0, y1 - y0, high - low)
    middle = _pose(0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (low + high))
    box = new("vision_msgs/msg/BoundingBox3D", middle, size)
    return new("vision_msgs/msg/Detection3D", head, [result], box, kept.object_id)


def _pose(x: float, y: float, z: float) -> object:
    upright = new("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0)
    return new("geometry_msgs/msg/Pose", new("geometry_msgs/msg/Point", x, y, z), upright)


def path_message(path: PlannedPath, stamp_ns: int, frame: str) -> bytes:
    """The path's points as poses without a heading of their own; empty without a path."""
    poses = [
        stamped_pose(GoalPose(float(x), float(y), 0.0), stamp_ns, frame) for x, y in path.points_m
    ]
    return encode(new(PATH, header(stamp_ns, frame), poses), PATH)
