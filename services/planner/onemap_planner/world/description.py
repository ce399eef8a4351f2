"""What the map shows of a described object: its anchors, its places, and the belief of all."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from onemap_planner.world.map_view import MapView, PlanningView, map_view_around
from onemap_shared.conditions import Thing
from onemap_shared.geometry import F32, Bool
from onemap_shared.grid import onto
from onemap_shared.joint_belief import (
    JointBelief,
    joint_belief,
    place_masks,
    place_weights,
)
from onemap_shared.messages import Detail, MapPlaces


@dataclass(frozen=True, slots=True)
class Description:
    """What is said of the object that is sought, and what the map shows of it.

    anchors: similarity (nx, ny) to each other object that is named, NaN where not observed; joint:
    None if nothing that the map shows is said of the object; places: of the map; shown: the cells
    (nx, ny) of those that are named and that the map shows; settled: those of them that stay in
    it whatever is seen later; found: anchors among the finds that the
    map keeps, by name.
    """

    detail: Detail
    anchors: Mapping[str, F32]
    joint: JointBelief | None
    places: MapPlaces
    shown: Mapping[str, Bool]
    settled: Mapping[str, Bool]
    found: Mapping[str, Sequence[Thing]] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def place(self) -> Bool | None:
        """Cells (nx, ny) of the places in one of which it is; None while one is not shown."""
        names = self.detail.inside
        if not names or not all(name in self.shown for name in names):
            return None
        mask: Bool = np.logical_or.reduce([self.shown[name] for name in names])
        return mask

    def believed(self, map_view: MapView, *, drawn: bool = False) -> MapView:
        """The map view with the joint belief as similarity.

        drawn: with what the anchors alone let expect where nobody looked.
        """
        if self.joint is None:
            return map_view
        looked = map_view.explored if drawn else None
        return replace(map_view, similarity=self.joint.similarity(map_view.similarity, looked))


def described(
    detail: Detail,
    views: Iterable[PlanningView],
    places: MapPlaces,
    map_view: MapView,
    robot_xy: tuple[float, float],
) -> Description | None:
    """The description on the grid of the map view; None while the view of an anchor is missing.

    views: of the map, for the anchors; places: of the map; robot_xy: metres.
    """
    by_name = {view.text: view for view in views}
    if not by_name.keys() >= set(detail.anchors):
        return None
    grid = map_view.grid
    anchors = {}
    for name in detail.anchors:
        around = map_view_around(by_name[name], np.asarray(robot_xy))
        anchors[name] = onto(grid, around.grid, around.similarity, np.nan)
    shown = place_masks(detail, places, grid)
    joint = None
    if detail.located or map_view.likeness is not None:
        joint = joint_belief(
            anchors,
            detail,
            places=place_weights(detail, shown, grid),
            cell_size_m=grid.cell_size_m,
            likeness=map_view.likeness,
        )
    settled = place_masks(detail, places, grid, settled=True)
    return Description(detail, anchors, joint, places, shown, settled)
