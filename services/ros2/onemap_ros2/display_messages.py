"""What RViz, nav2 and Foxglove take, as messages: grids, finds, frontiers, the path."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onemap_ros2 import cdr
from onemap_shared.grid import GridSpec
from onemap_shared.messages import (
    KeptObject,
    Layer,
    Occupancy,
    PlannedPath,
    SearchView,
)
from onemap_shared.places import Zones

UNKNOWN, FREE, OCCUPIED = -1, 0, 100


def occupancy_grid(view: SearchView, frame: str) -> bytes:
    """What nav2's static layer reads: -1 unknown, 0 free, 100 occupied."""
    values = np.full(view.grid.shape, UNKNOWN, np.int8)
    values[view.occupancy == Occupancy.FREE] = FREE
    values[view.occupancy == Occupancy.OCCUPIED] = OCCUPIED
    return _grid(view.grid, view.stamp_ns, values, frame)


def similarity_grid(view: SearchView, frame: str) -> bytes:
    """The similarity to the word in percent, -1 where nothing was observed or without a word."""
    values, scored = np.full(view.grid.shape, UNKNOWN, np.int8), _scored(view)
    percent = np.rint(np.clip(view.similarity[scored], 0.0, 1.0) * 100.0)
    values[scored] = percent.astype(np.int8)
    return _grid(view.grid, view.stamp_ns, values, frame)


def _scored(view: SearchView) -> NDArray[np.bool_]:
    """Where there is a similarity; an index of ``view.similarity`` too, which may be (0, 0)."""
    if view.similarity.shape != view.grid.shape:
        return np.zeros(view.similarity.shape, bool)
    scored: NDArray[np.bool_] = (view.layers & Layer.OBSERVED) > 0
    return scored & np.isfinite(view.similarity)


def _grid(grid: GridSpec, stamp_ns: int, values: NDArray[np.int8], frame: str) -> bytes:
    """``values`` (nx, ny) as a grid whose rows follow y, the lowest first."""
    x_m, y_m, *_ = grid.bounds_m
    (width, height), origin, made = grid.shape, cdr.pose(x_m, y_m), cdr.time_of(stamp_ns)
    info = cdr.new("nav_msgs/msg/MapMetaData", made, grid.cell_size_m, width, height, origin)
    return cdr.encode(
        cdr.new(cdr.GRID, cdr.header(stamp_ns, frame), info, values.T.ravel()), cdr.GRID
    )


AROUND_M = 50.0  # of the map: what a zone covers beyond is in no way of the robot
KEEP_OUT_FILTER = 0  # of nav2_msgs/CostmapFilterInfo


def keepout_mask(zones: Zones, stamp_ns: int, frame: str) -> bytes:
    """What nav2's keep-out filter reads: 100 in a zone and 0 elsewhere.

    It covers the map and the zones around it.
    """
    places = zones.places
    x0, y0, x1, y1 = places.grid.bounds_m
    low, high = np.array([x0, y0]), np.array([x1, y1])
    corners = [corner for place in places.places for corner in place.corners_m]
    points = np.clip(np.array([low, *corners, high - 1e-6]), low - AROUND_M, high + AROUND_M)
    (x0, y0), (x1, y1) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    grid = GridSpec.covering(places.grid.cell_size_m, (x0, y0), (x1, y1))
    values = np.where(zones.mask(grid), OCCUPIED, FREE).astype(np.int8)
    return _grid(grid, stamp_ns, values, frame)


def keepout_info(mask_topic: str, stamp_ns: int, frame: str) -> bytes:
    """What tells nav2's keep-out filter where its mask is, and that it holds costs as they are."""
    head = cdr.header(stamp_ns, frame)
    return cdr.encode(
        cdr.new(cdr.FILTER_INFO, head, KEEP_OUT_FILTER, mask_topic, 0.0, 1.0), cdr.FILTER_INFO
    )


MARKER, VECTOR = "visualization_msgs/msg/Marker", "geometry_msgs/msg/Vector3"
CYLINDER, SPHERE, SPHERE_LIST, TEXT = 3, 2, 7, 9
ADD, DELETE_ALL = 0, 3
FIND_SIZE = LETTER_SIZE = (0.25, 0.25, 0.25)  # metres
REGION_SIZE, FRONTIER_SIZE = (0.4, 0.4, 0.05), (0.15, 0.15, 0.15)
LABEL_ABOVE_M = 0.35
MAX_MARKED = 300  # frontiers of a hall: RViz draws them as one list
FIND_COLOR = (0.1, 0.75, 0.2, 1.0)
FRONTIER_COLOR = (0.1, 0.5, 1.0, 0.8)
REGION_COLOR = (1.0, 0.55, 0.0)
Place = tuple[float, float, float]


class Mark(NamedTuple):
    """What one marker shows: names, places in metres of the map frame, size in metres, RGBA."""

    namespace: str
    number: int
    kind: int
    place: Place = (0.0, 0.0, 0.0)
    size: Place = (1.0, 1.0, 1.0)
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    text: str = ""
    points: Sequence[Place] = ()
    action: int = ADD


def marker_array(
    objects: Iterable[KeptObject], path: PlannedPath | None, stamp_ns: int, frame: str
) -> bytes:
    """All markers; those of the message before are deleted first.

    Namespaces: finds (a sphere and its name), regions (a disc, the fainter the lower its score)
    and frontiers (spheres in one list).
    """
    marks = [Mark("", 0, SPHERE, action=DELETE_ALL)]
    for number, kept in enumerate(objects):
        x, y, z = kept.position_m
        label = x, y, z + LABEL_ABOVE_M
        marks.append(Mark("finds", 2 * number, SPHERE, (x, y, z), FIND_SIZE, FIND_COLOR))
        marks.append(Mark("finds", 2 * number + 1, TEXT, label, LETTER_SIZE, text=kept.name))
    if path is not None:
        scored = zip(path.regions_m[:MAX_MARKED].tolist(), path.region_scores, strict=False)
        for number, ((x, y), score) in enumerate(scored):
            color = (*REGION_COLOR, 0.2 + 0.7 * min(max(float(score), 0.0), 1.0))
            marks.append(Mark("regions", number, CYLINDER, (x, y, 0.0), REGION_SIZE, color))
        points = [(x, y, 0.0) for x, y in path.frontiers_m[:MAX_MARKED].tolist()]
        if points:
            paint = FRONTIER_SIZE, FRONTIER_COLOR
            marks.append(Mark("frontiers", 0, SPHERE_LIST, (0, 0, 0), *paint, points=points))
    head = cdr.header(stamp_ns, frame)
    return cdr.encode(
        cdr.new(cdr.MARKER_ARRAY, [_marker(head, mark) for mark in marks]), cdr.MARKER_ARRAY
    )


def _marker(head: object, mark: Mark) -> object:
    nothing = np.zeros(0, np.uint8)
    return cdr.new(
        MARKER,
        head,
        mark.namespace,
        mark.number,
        mark.kind,
        mark.action,
        cdr.pose(*mark.place),
        cdr.new(VECTOR, *mark.size),
        cdr.new("std_msgs/msg/ColorRGBA", *mark.color),
        cdr.new("builtin_interfaces/msg/Duration", 0, 0),  # it stays
        False,
        [cdr.new(cdr.POINT, *point) for point in mark.points],
        [],
        "",
        cdr.new("sensor_msgs/msg/CompressedImage", cdr.header(0, ""), "", nothing),
        [],
        mark.text,
        "",
        cdr.new("visualization_msgs/msg/MeshFile", "", nothing),
        False,
    )


def path_message(path: PlannedPath | None, stamp_ns: int, frame: str) -> bytes:
    """The path's points as poses without a heading of their own; empty without a path."""
    head, points = cdr.header(stamp_ns, frame), () if path is None else path.points_m.tolist()
    poses = [cdr.new(cdr.POSE_STAMPED, head, cdr.pose(x, y)) for x, y in points]
    return cdr.encode(cdr.new(cdr.PATH, head, poses), cdr.PATH)
