"""Whether what was found is as described: where its anchors are, in which place, of which colour.

A relation holds if the kernel of the joint belief holds by half or more between the cells of both.
Where it does not, and floor around the object was not seen yet, it cannot be told.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.memory import FoundObject, TargetMemory
from onemap_planner.sentences import a, the
from onemap_planner.world.candidates import MIN_SIGHTINGS, ObjectCandidate
from onemap_planner.world.colours import has_colour
from onemap_planner.world.description import Description
from onemap_planner.world.frontiers import area_in_view
from onemap_planner.world.map_view import MapView
from onemap_shared.geometry import I64
from onemap_shared.joint_belief import FADE_M, REACH_M, kernel
from onemap_shared.messages import Occupancy, Relation, RelationKind
from onemap_shared.names import same_name

HOLDS = 0.5  # of the kernel, or of a place's weight
ANCHOR_FOUND = 0.5  # similarity from which cells count as the anchor; SIMILAR is right in a quarter
SLACK_M = 0.1  # of heights: a cushion lies hardly higher than the middle of its sofa
UNSEEN_M2 = 0.3  # of floor around an object that may hide its anchor: a chair's


@dataclass(frozen=True, slots=True)
class FindCheck:
    """What is known of a description.

    holds: None if it cannot be told yet; told: the parts that hold or were not checked; wrong:
    those that do not hold, or may not.
    """

    holds: bool | None = True
    told: tuple[str, ...] = ()
    wrong: tuple[str, ...] = ()


AS_DESCRIBED = FindCheck()


def check_find(
    candidate: ObjectCandidate,
    context: PlanningContext,
    memory: TargetMemory,
    found_objects: Sequence[FoundObject] = (),
) -> FindCheck:
    """The check of a candidate.

    An anchor is where the map shows it clearly, where it was detected and where it was found.
    """
    description = context.description
    if description is None:
        return AS_DESCRIBED
    cells = context.map_view.indices_of(candidate.surface)
    if len(cells) == 0:
        return FindCheck(None)
    anchors = {
        name: _anchor_cells(name, description, context.map_view, memory, found_objects)
        for name in description.detail.anchors
    }
    parts = [
        _relation(relation, candidate, anchors, context.map_view, memory)
        for relation in description.detail.relations
    ]
    parts += _places(cells, description)
    parts += _colour(candidate, description.detail.colour)
    held = {part.holds for part in parts}
    return FindCheck(
        False if False in held else None if None in held else True,
        tuple(text for part in parts for text in part.told),
        tuple(text for part in parts for text in part.wrong),
    )


def _relation(
    relation: Relation,
    candidate: ObjectCandidate,
    anchors: Mapping[str, I64],
    map_view: MapView,
    memory: TargetMemory,
) -> FindCheck:
    cells = map_view.indices_of(candidate.surface)
    away_m = np.array([_distance_m(cells, anchors[name], map_view) for name in relation.anchors])
    near = bool((kernel(relation.kind, away_m) >= HOLDS).all())
    if near and _at_height(relation, candidate, memory):
        return FindCheck(True, (_holding(relation, float(away_m.max())),))
    hidden = not near and _unseen_m2(cells, map_view, REACH_M[relation.kind] + FADE_M) >= UNSEEN_M2
    wrong = f"not {_words(relation.kind)} {' and '.join(map(a, relation.anchors))}"
    return FindCheck(None, (), (f"perhaps {wrong}",)) if hidden else FindCheck(False, (), (wrong,))


def _at_height(relation: Relation, candidate: ObjectCandidate, memory: TargetMemory) -> bool:
    """Whether it is as high as what lies on, or under, the anchor that is nearest.

    The middle of what was seen of one is compared with that of the other, whose sides and legs are
    seen too: what lies on it is higher. True if the anchor was not detected.
    """
    seen = _detected(relation.anchors[0], memory)
    if relation.kind not in (RelationKind.ON, RelationKind.UNDER) or not seen:
        return True
    nearest = min(seen, key=lambda anchor: anchor.distance_m(candidate.xyz))
    above_m = candidate.xyz[2] - nearest.xyz[2]
    return above_m >= -SLACK_M if relation.kind is RelationKind.ON else above_m <= SLACK_M


def _detected(name: str, memory: TargetMemory) -> list[ObjectCandidate]:
    return [c for c in memory.anchors.get(name, ()) if c.sightings >= MIN_SIGHTINGS]


def _anchor_cells(
    name: str,
    description: Description,
    map_view: MapView,
    memory: TargetMemory,
    found_objects: Sequence[FoundObject],
) -> I64:
    """Cells (K, 2) of the anchor."""
    similar = np.nan_to_num(description.anchors[name].similarity, nan=0.0) >= ANCHOR_FOUND
    known = [anchor.surface for anchor in _detected(name, memory)]
    known += [each.cells for each in found_objects if same_name(each.name, name)]
    return np.vstack([np.argwhere(similar), *map(map_view.indices_of, known)])


def _distance_m(cells: I64, anchor: I64, map_view: MapView) -> float:
    """Metres between the nearest cells of both, infinity without any."""
    if len(anchor) == 0:
        return float("inf")
    away, _ = cKDTree(anchor).query(cells)
    return float(away.min()) * map_view.grid.cell_size_m


def _unseen_m2(cells: I64, map_view: MapView, range_m: float) -> float:
    """Floor around the cells (K, 2) in sight of their middle that nobody has seen well."""
    occupancy = map_view.occupancy.copy()
    occupancy[tuple(cells.T)] = Occupancy.FREE  # it does not hide its own surroundings
    around = replace(map_view, occupancy=occupancy)
    middle = cells[np.hypot(*(cells - cells.mean(axis=0)).T).argmin()]
    return float(area_in_view(around, ~map_view.explored, middle[None], range_m)[0])


def _places(cells: I64, description: Description) -> list[FindCheck]:
    detail = description.detail
    if not (detail.inside or detail.outside):
        return []
    there = float(np.median(description.places[tuple(cells.T)])) >= HOLDS
    said = (("", detail.inside), ("not ", detail.outside))
    words = [(no, f"in {' or '.join(map(the, names))}") for no, names in said if names]
    if there and not description.shows_place:
        return [FindCheck(None, (), (f"perhaps not in {' or '.join(map(the, detail.inside))}",))]
    if there:
        return [FindCheck(True, tuple(no + where for no, where in words))]
    wrong = " or ".join(where if no else f"not {where}" for no, where in words)
    return [FindCheck(False, (), (wrong,))]


def _colour(candidate: ObjectCandidate, colour: str) -> list[FindCheck]:
    if not colour:
        return []
    has, unchecked = has_colour(candidate.best_view, colour)
    if has:
        return [FindCheck(True, (f"colour not checked: {unchecked}" if unchecked else colour,))]
    return [FindCheck(has, (), (f"not {colour}" if has is False else f"perhaps not {colour}",))]


def _words(kind: RelationKind) -> str:
    return str(kind).replace("_", " ")


def _holding(relation: Relation, away_m: float) -> str:
    if relation.kind is RelationKind.NEXT_TO:
        return f"{away_m:.1f} m from {the(relation.anchors[0])}"
    return f"{_words(relation.kind)} {' and '.join(map(the, relation.anchors))}"
