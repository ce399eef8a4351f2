"""Whether what was found is as described: where its anchors are, in which place, of which colour.

A relation holds if the probability of the anchor times the kernel of the joint belief is half or
more for a cell of it. It cannot be told where a cell may be the anchor, or where the relation does
not hold and floor around the object was not seen yet.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from scipy.spatial import cKDTree

from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.state import Evidence, FoundObject
from onemap_planner.sentences import a, the
from onemap_planner.world.candidates import MIN_SIGHTINGS, ObjectCandidate
from onemap_planner.world.colours import has_colour
from onemap_planner.world.description import Description
from onemap_planner.world.frontiers import area_in_view
from onemap_planner.world.map_view import MapView
from onemap_planner.world.regions import SIMILAR
from onemap_shared.geometry import F64, I64
from onemap_shared.joint_belief import FADE_M, REACH_M, kernel
from onemap_shared.messages import Occupancy, Relation, RelationKind
from onemap_shared.names import same_name

HOLDS = 0.5  # of the kernel, or of a place's weight
UNLIKE = 0.1  # likeness of its cells' colours below which it has another one
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
Part: TypeAlias = tuple[bool | None, str]  # whether it holds, and what does, or what does not


def check_find(
    candidate: ObjectCandidate,
    context: PlanningContext,
    evidence: Evidence,
    found_objects: Sequence[FoundObject] = (),
) -> FindCheck:
    """The check of a candidate.

    An anchor is where the map shows it, and certainly where it was detected or found.
    """
    description, map_view = context.description, context.map_view
    if description is None:
        return AS_DESCRIBED
    cells = map_view.indices_of(candidate.surface)
    if len(cells) == 0:
        return FindCheck(None)
    detail, anchors = description.detail, {}
    for name in description.detail.anchors:
        anchors[name] = _anchor(name, description, map_view, evidence, found_objects)
    parts = [_relation(each, candidate, anchors, map_view, evidence) for each in detail.relations]
    parts += [*_places(cells, description), *_colour(candidate, cells, detail.colour, map_view)]
    parts += _not_excluded(candidate, cells, detail.negatives, map_view)
    held = {holds for holds, _ in parts}
    return FindCheck(
        False if False in held else None if None in held else True,
        tuple(what for holds, what in parts if holds),
        tuple(f"perhaps {what}" if holds is None else what for holds, what in parts if not holds),
    )


def _relation(
    relation: Relation,
    candidate: ObjectCandidate,
    anchors: Mapping[str, Anchor],
    map_view: MapView,
    evidence: Evidence,
) -> Part:
    cells, kind = map_view.indices_of(candidate.surface), relation.kind
    found = [anchors[name].belief(kind, cells, map_view) for name in relation.anchors]
    believed, away_m = min(each[0] for each in found), max(each[1] for each in found)
    if not _at_height(relation, candidate, evidence):
        believed = 0.0
    if believed >= HOLDS:
        words = f"{away_m:.1f} m from" if kind is RelationKind.NEXT_TO else kind.words
        return True, f"{words} {' and '.join(map(the, relation.anchors))}"
    hidden = believed >= SIMILAR or (
        away_m > REACH_M[kind] and _unseen_m2(cells, map_view, REACH_M[kind] + FADE_M) >= UNSEEN_M2
    )
    wrong = f"not {kind.words} {' and '.join(map(a, relation.anchors))}"
    return None if hidden else False, wrong


def _at_height(relation: Relation, candidate: ObjectCandidate, evidence: Evidence) -> bool:
    """Whether it is as high as what lies on, or under, the anchor that is nearest.

    The middle of what was seen of one is compared with that of the other, whose sides and legs are
    seen too: what lies on it is higher. True if the anchor was not detected.
    """
    seen = _detected(relation.anchors[0], evidence)
    if relation.kind not in (RelationKind.ON, RelationKind.UNDER) or not seen:
        return True
    nearest = min(seen, key=lambda anchor: anchor.distance_m(candidate.xyz))
    above_m = candidate.xyz[2] - nearest.xyz[2]
    return above_m >= -SLACK_M if relation.kind is RelationKind.ON else above_m <= SLACK_M


def _detected(name: str, evidence: Evidence) -> list[ObjectCandidate]:
    return [c for c in evidence.anchors.get(name, ()) if c.sightings >= MIN_SIGHTINGS]


@dataclass(frozen=True, slots=True)
class Anchor:
    """Cells (K, 2) that may be of the anchor, and the probability (K,) that each is."""

    cells: I64
    probability: F64

    def belief(self, kind: RelationKind, cells: I64, map_view: MapView) -> tuple[float, float]:
        """Probability that the relation holds between it and the cells (N, 2), and metres between
        them and what speaks for it; 0 and infinity without any."""
        if len(self.cells) == 0:
            return 0.0, float("inf")
        away, _ = cKDTree(cells).query(self.cells)
        away_m = away * map_view.grid.cell_size_m
        believed = self.probability * kernel(kind, away_m)
        most = float(believed.max())
        return most, float(away_m[believed >= min(most, HOLDS)].min())


def _anchor(
    name: str,
    description: Description,
    map_view: MapView,
    evidence: Evidence,
    found_objects: Sequence[FoundObject],
) -> Anchor:
    similarity = np.nan_to_num(description.anchors[name].similarity, nan=0.0)
    similar = np.argwhere(similarity >= SIMILAR)
    known = [anchor.surface for anchor in _detected(name, evidence)]
    known += [each.cells for each in found_objects if same_name(each.name, name)]
    cells = np.vstack([np.empty((0, 2), np.int64), *map(map_view.indices_of, known)])
    probability = np.concatenate([similarity[tuple(similar.T)], np.ones(len(cells))])
    return Anchor(np.vstack([similar, cells]), probability)


def _unseen_m2(cells: I64, map_view: MapView, range_m: float) -> float:
    """Floor around the cells (K, 2) in sight of their middle that nobody has seen well."""
    occupancy = map_view.occupancy.copy()
    occupancy[tuple(cells.T)] = Occupancy.FREE  # it does not hide its own surroundings
    around = replace(map_view, occupancy=occupancy)
    middle = cells[np.hypot(*(cells - cells.mean(axis=0)).T).argmin()]
    return float(area_in_view(around, ~map_view.explored, middle[None], range_m)[0])


def _places(cells: I64, description: Description) -> Iterator[Part]:
    detail, shown = description.detail, description.shown
    others = [name for name in detail.outside if name in shown]
    in_one, in_others = (f"in {' or '.join(map(the, each))}" for each in (detail.inside, others))
    is_shown = any(name in shown for name in detail.inside)
    if float(np.median(description.places[tuple(cells.T)])) < HOLDS:
        wrong = ([f"not {in_one}"] if is_shown else []) + ([in_others] if others else [])
        yield False, " or ".join(wrong)
        return
    if detail.inside:
        yield (True, in_one) if is_shown else (None, f"not {in_one}")
    if others:
        yield True, f"not {in_others}"
    for name in detail.outside:
        if name not in shown:
            yield True, f"{name} not checked: no such place is known"


def _not_excluded(
    candidate: ObjectCandidate, cells: I64, negatives: Sequence[str], map_view: MapView
) -> Iterator[Part]:
    """They compete with the name on the map: where it loses, the thing is one of them.

    What the map does not agree with at all tells nothing of them; the detector lets them compete.
    """
    if negatives and not candidate.supported:
        yield True, f"{' or '.join(map(a, negatives))} not checked: the map shows neither"
    elif negatives:
        names, similarity = " or ".join(map(a, negatives)), map_view.similarity[tuple(cells.T)]
        known = similarity[np.isfinite(similarity)]
        if known.size and float(np.median(known)) >= SIMILAR:
            yield True, f"not {names}"
        else:
            yield False if known.size else None, names


def _colour(
    candidate: ObjectCandidate, cells: I64, colour: str, map_view: MapView
) -> Iterator[Part]:
    """By its picture; where that does not tell, by the mean colours of its cells."""
    if colour:
        has, unchecked = has_colour(candidate.best_view, colour)
        if (has is None or unchecked) and map_view.likeness is not None:
            alike = float(np.median(np.nan_to_num(map_view.likeness[tuple(cells.T)], nan=UNLIKE)))
            if not UNLIKE <= alike < HOLDS:
                has, unchecked = alike >= HOLDS, ""
        told = f"colour not checked: {unchecked}" if unchecked else colour
        yield has, told if has else f"not {colour}"
