"""Belief in a thing of which more is said than its name: next to a bed, in the kitchen.

The beliefs of the thing and of its anchors are multiplied cell by cell, as DIV-Nav does (arXiv
2510.16518), with the relation as a kernel of distance. For a target with the probability T(x), an
anchor with A(y) and the place mask M(x):

    K(x) = max over y of A(y) k(|x - y|)        J(x) = T(x) M(x) product of K(x)

with k = 1 up to the relation's reach r and 2^-((d - r) / f)^2 beyond. Cells that nobody has looked
at from near have at least ``DRAW`` M(x) product of K(x): there the anchor alone speaks.
Where a colour is said, J is multiplied with how well the mean colour of the cell is it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from onemap_shared.geometry import F32, F64, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import NO_ROOM, Detail, MapPlaces, RelationKind
from onemap_shared.messages.details import NEXT_TO_M
from onemap_shared.places import place_mask

# Metres up to which a relation holds in full: what lies on a thing covers its cells, what is
# between two things is near both.
REACH_M = {
    RelationKind.NEXT_TO: NEXT_TO_M,
    RelationKind.ON: 0.1,
    RelationKind.UNDER: 0.1,
    RelationKind.IN: 0.1,
    RelationKind.BETWEEN: 1.5,
}
FADE_M = 0.25  # beyond it, until a relation holds by half: what the map blurs, two cells
FADED = 2.5  # fades after which nothing is left: a hundredth
OCTAGON = 2**0.5 - 1  # share of the steps to all eight neighbours that makes a regular octagon
UNSEEN = 0.2  # probability that the anchor is in a cell that nobody saw, as of frontiers
# Probability that the target is at a place that fits, before anybody looked: one of two such.
DRAW = 0.5
ROOM_GROWTH_M = 1.0  # from the free floor of a room into its furniture: half a bed's width and more


def by_rank(guidance: F32) -> F32:
    """Similarity (nx, ny) by rank: 0 up to the 90th percentile of the map, 1 for its best cell.

    The cosines of an encoder without calibration lie close together, each encoder's elsewhere:
    no threshold on them holds for two encoders, but a rank does.
    """
    similarity: F32 = np.clip((guidance - np.float32(0.9)) / np.float32(0.1), 0.0, 1.0)
    return similarity


def kernel(kind: RelationKind, distance_m: F64) -> F64:
    """How far a relation holds at these distances, in [0, 1]; never more at a larger one."""
    beyond: F64 = np.maximum(distance_m - REACH_M[kind], 0.0) / FADE_M
    return np.exp2(-(beyond**2))


def relation_belief(kind: RelationKind, anchor: F32, cell_size_m: float) -> F32:
    """K (nx, ny): probability that each cell is so related to an anchor of similarity (nx, ny).

    Distances are those of an octagon, up to 8 percent shorter than straight ones: the belief grows
    a cell at a time, which takes a tenth of the time of exact distances.
    """
    grown = np.where(np.isfinite(anchor), anchor, np.float32(UNSEEN))
    steps = int((REACH_M[kind] + FADED * FADE_M) / cell_size_m)
    strength = kernel(kind, cell_size_m * np.arange(steps + 1.0)).astype(np.float32)
    found: F32 = grown * strength[0]
    for step in range(1, steps + 1):
        grown = _grown(grown, corners=int(step * OCTAGON) > int((step - 1) * OCTAGON))
        np.maximum(found, strength[step] * grown, out=found)
    return found


def _grown(values: F32, *, corners: bool) -> F32:
    """The largest of each cell (nx, ny) and its four neighbours, or all eight."""
    wider: F32 = values.copy()
    np.maximum(wider[1:], values[:-1], out=wider[1:])
    np.maximum(wider[:-1], values[1:], out=wider[:-1])
    along = wider.copy() if corners else values
    np.maximum(wider[:, 1:], along[:, :-1], out=wider[:, 1:])
    np.maximum(wider[:, :-1], along[:, 1:], out=wider[:, :-1])
    return wider


@dataclass(frozen=True, slots=True)
class JointBelief:
    """How a description fits each cell, for every similarity of the target.

    fits (nx, ny): M(x) product of K(x), in [0, 1]; likeness (nx, ny): of the cell's colour, 1 where
    any will do; located: whether anything is said of where the target is.
    """

    fits: F32
    likeness: F32
    located: bool

    def similarity(self, target: F32, looked: Bool | None = None) -> F32:
        """J (nx, ny) of a target of similarity (nx, ny).

        looked (nx, ny): cells where the target would have been seen; None: all of them.
        """
        found: F32 = target * self.fits * self.likeness
        if looked is not None and self.located:
            drawn = np.isfinite(found) & ~looked
            found[drawn] = np.maximum(found, np.float32(DRAW) * self.fits)[drawn]
        return found


def joint_belief(
    anchors: Mapping[str, F32],
    detail: Detail,
    *,
    places: F64,
    cell_size_m: float,
    likeness: F32 | None = None,
) -> JointBelief:
    """The belief in a target that is described.

    anchors: similarity (nx, ny) of every anchor of the detail; places (nx, ny): as of
    ``place_weights``; likeness (nx, ny): of the cell's colour, NaN where it is not known, None: any
    colour.
    """
    fits = places.astype(np.float32)
    for relation in detail.relations:
        for name in relation.anchors:
            fits *= relation_belief(relation.kind, anchors[name], cell_size_m)
    known = np.ones_like(fits) if likeness is None else np.nan_to_num(likeness, nan=1.0)
    return JointBelief(fits, known, detail.located)


def place_masks(
    detail: Detail, places: MapPlaces, grid: GridSpec, *, settled: bool = False
) -> dict[str, Bool]:
    """Cells (nx, ny) of each place that a detail names and the map shows.

    Those of a room are also of what stands in it and of its walls: of the nearest room within
    ``ROOM_GROWTH_M``. settled: as of ``place_mask``.
    """
    names, none = (*detail.inside, *detail.outside), places.ids == NO_ROOM
    if names and not none.all():
        away, (x, y) = ndimage.distance_transform_edt(none, return_indices=True)
        near = away * places.grid.cell_size_m <= ROOM_GROWTH_M
        ids, parts = (
            np.where(near, each[x, y], np.int32(NO_ROOM)) if each.size else each
            for each in (places.ids, places.parts)
        )
        places = replace(places, ids=ids, parts=parts)
    masks = {name: place_mask(places, name, grid, settled=settled) for name in names}
    return {name: mask for name, mask in masks.items() if mask.any()}


def place_weights(detail: Detail, masks: Mapping[str, Bool], grid: GridSpec) -> F64:
    """M (nx, ny): 1 in one of the places inside of which it is, 0 in those that it is not in.

    masks: as of ``place_masks``. Beside a place it fades; places that the map does not show yet
    restrict nothing.
    """
    weights: F64 = np.ones(grid.shape)
    if inside := [masks[name] for name in detail.inside if name in masks]:
        away_m = grid.cell_size_m * ndimage.distance_transform_edt(~np.logical_or.reduce(inside))
        weights = np.exp2(-((away_m / FADE_M) ** 2))
    for name in detail.outside:
        if name in masks:
            weights[masks[name]] = 0.0
    return weights
