"""Small maps drawn as text, for tests that look at one step only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from onemap_planner.policy.params import PlannerParams
from onemap_planner.world.costmap import BesideMap, Costmap, CostmapParams, build_costmap
from onemap_planner.world.map_view import MapView
from onemap_shared.geometry import F32, F64, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import (
    NO_ROOM,
    Detections,
    Layer,
    MapPlaces,
    Occupancy,
    Place,
    SearchView,
)

CELL_M = 0.1
NO_POINTS = np.zeros((0, 2))
PARAMS = PlannerParams()
# Not validated: no robot is a point, but tests of one step need no room around theirs.
POINT_ROBOT = CostmapParams().model_copy(
    update={
        "radius_m": 0.0,
        "margin_m": 0.05,
        "inflation_m": 0.01,
        "inflation_weight": 0.0,
        "escape_radius_m": 0.3,
        "escape_below_m2": 0.02,
    }
)


def drawn_map(*rows: str, scale: int = 1, similarity: F32 | None = None) -> MapView:
    """A map view from rows of characters; rows run along x, characters along y.

    ``#`` occupied, ``.`` free and explored, ``,`` free and observed only, ``a`` as ``.`` but
    assumed, not seen, ``g`` occupied where the floor was seen once, ``v`` a drop, blank unknown.
    Each character is ``scale`` cells square.
    """
    letters = np.array([list(row) for row in rows]).repeat(scale, axis=0).repeat(scale, axis=1)
    occupancy = np.full(letters.shape, Occupancy.FREE, np.uint8)
    occupancy[np.isin(letters, ["#", "g", "v"])] = Occupancy.OCCUPIED
    occupancy[letters == " "] = Occupancy.UNKNOWN
    observed = letters != " "
    return MapView(
        grid=GridSpec(CELL_M, (0, 0), (letters.shape[0], letters.shape[1])),
        occupancy=occupancy,
        observed=observed,
        explored=observed & (letters != ","),
        assumed=letters == "a",
        floor_seen=np.isin(letters, list(".,g")),
        drops=letters == "v",
        similarity=(
            np.where(observed, np.float32(0.1), np.float32(np.nan)).astype(np.float32)
            if similarity is None
            else similarity
        ),
        margin=np.full(letters.shape, np.inf, np.float32),
        guidance=np.where(observed, np.float32(0.5), np.float32(np.nan)),
    )


def costmap_of(
    map_view: MapView,
    robot_xy: tuple[float, float],
    params: CostmapParams = POINT_ROBOT,
    *,
    trail_xy: F64 = NO_POINTS,
    obstacles_xy: F64 = NO_POINTS,
    appeared_xy: F64 = NO_POINTS,
    looked_into_xy: F64 = NO_POINTS,
    closed_xy: F64 = NO_POINTS,
) -> Costmap:
    """The costmap of the map alone unless more is given."""
    beside = BesideMap(
        trail_xy,
        obstacles_xy,
        appeared_xy=appeared_xy,
        looked_into_xy=looked_into_xy,
        closed_xy=closed_xy,
    )
    return build_costmap(map_view, np.array(robot_xy), params, beside)


def crossable(costmap: Costmap) -> Bool:
    """Mask (nx, ny) of the unknown cells that a path may enter all the same, slowly."""
    mask: Bool = costmap.passable & ~costmap.free & ~costmap.occupied
    return mask


def detections_of(
    points_of: Mapping[str, Sequence[Sequence[float]]],
    *,
    score: float = 0.8,
    independent: bool = False,
) -> Detections:
    """One frame with a detection of each name, with its points in metres."""
    points = [np.array(each, np.float32).reshape(-1, 3) for each in points_of.values()]
    owner = np.repeat(np.arange(len(points)), [len(each) for each in points])
    count = len(points)
    return Detections(
        sequence=1,
        stamp_ns=0,
        detector_id="test",
        names=tuple(points_of),
        boxes_px=np.zeros((count, 4), np.float32),
        scores=np.full(count, score, np.float32),
        points_map=np.concatenate([np.zeros((0, 3), np.float32), *points]),
        point_owner=owner.astype(np.int32),
        independent=independent,
    )


def places_of(
    grid: GridSpec, *known: Place, version: int = 0, rooms: tuple[int, ...] = ()
) -> MapPlaces:
    """These places on a map without rooms, or in rooms of these ids that have no cells yet."""
    ids = np.full(grid.shape, NO_ROOM, np.int32)
    return MapPlaces(version, 0, known, rooms or (NO_ROOM,) * len(known), grid, ids)


def search_view_of(map_view: MapView, text: str = "sofa") -> SearchView:
    """The message that this map view would come from."""
    layers = (
        map_view.observed * Layer.OBSERVED
        + map_view.explored * Layer.EXPLORED
        + map_view.assumed * Layer.ASSUMED
        + map_view.floor_seen * Layer.FLOOR_SEEN
        + map_view.drops * Layer.DROP
    )
    return SearchView(
        text=text,
        revision=1,
        sequence=1,
        stamp_ns=0,
        grid=map_view.grid,
        occupancy=map_view.occupancy,
        layers=layers.astype(np.uint8),
        similarity=map_view.similarity,
    )
