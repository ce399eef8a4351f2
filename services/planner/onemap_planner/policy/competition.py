"""Names compete for places: what another name fits better is not the object.

A place is contested by the other names of the search, cell by cell on the map and detection
by detection, and by what was found before: a bed that was confirmed is not a sofa next.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from onemap_planner.world.candidates import (
    ConsensusParams,
    ObjectCandidate,
    Sighting,
    is_same_object,
)
from onemap_planner.world.map_view import MapView, WorldCells
from onemap_shared.geometry import F64
from onemap_shared.messages import MAX_RIVALS, Detections, TextEmbeddings
from onemap_shared.names import normalised, same_name

# Two sets of cells are one place if they share this part of the smaller one. A pillow on a bed
# is another place: its cells never looked like the bed.
SAME_PLACE = 0.5
MAX_FOUND_OBJECTS = 64  # finds remembered, the newest; the oldest are forgotten


@dataclass(frozen=True, slots=True)
class FoundObject:
    """A find: its name and the world cells that supported it."""

    name: str
    cells: WorldCells


# Pairs of normalised names that mean the same and so do not compete.
Synonyms = frozenset[frozenset[str]]
NO_SYNONYMS: Synonyms = frozenset()


def synonyms_of(embeddings: TextEmbeddings) -> Synonyms:
    """The pairs among the texts that mean the same to the encoder."""
    pairs = np.argwhere(np.triu(embeddings.same_meaning(), 1))
    texts = [normalised(text) for text in embeddings.texts]
    return frozenset(frozenset((texts[one], texts[other])) for one, other in pairs)


def with_found_object(
    found_objects: tuple[FoundObject, ...], name: str, candidate: ObjectCandidate
) -> tuple[FoundObject, ...]:
    """The claims and that of a candidate just confirmed."""
    return (*found_objects, FoundObject(name, candidate.cells))[-MAX_FOUND_OBJECTS:]


def rival_names(
    target: str,
    objects: Iterable[str],
    found_objects: Iterable[FoundObject],
    synonyms: Synonyms = NO_SYNONYMS,
) -> tuple[str, ...]:
    """Other names that what looks like the target may be: of the search, then of newest finds."""
    newest_first = reversed([found_object.name for found_object in found_objects])
    names = dict.fromkeys((*objects, *newest_first))
    return tuple(n for n in names if not means_same(n, target, synonyms))[:MAX_RIVALS]


def found_under_other_names(
    found_objects: Iterable[FoundObject], target: str, synonyms: Synonyms
) -> tuple[FoundObject, ...]:
    """The finds of names that do not mean the target."""
    return tuple(c for c in found_objects if not means_same(c.name, target, synonyms))


def conflicting_object(
    candidate: ObjectCandidate, found_objects: Iterable[FoundObject], map_view: MapView
) -> FoundObject | None:
    """The find, of those of other names, that the candidate's place belongs to; None: it is free.

    It does if the two are one place, and if over the cells of both some other name fits the
    map better than the target, on average.
    """
    for found_object in found_objects:
        if not _overlap(found_object.cells, candidate.cells):
            continue
        cells = map_view.indices_of(candidate.cells | found_object.cells)
        own = map_view.similarity[cells[:, 0], cells[:, 1]]
        other = map_view.rival[cells[:, 0], cells[:, 1]]
        seen = np.isfinite(own) & np.isfinite(other)
        if seen.any() and other[seen].mean() > own[seen].mean():
            return found_object
    return None


def found_object_at(
    cell: tuple[int, int], found_objects: Sequence[FoundObject]
) -> FoundObject | None:
    """The newest of these finds that a world cell supported."""
    return next(
        (found_object for found_object in reversed(found_objects) if cell in found_object.cells),
        None,
    )


def count_contradictions(
    candidates: tuple[ObjectCandidate, ...],
    detections: Detections,
    seen: Sequence[Sighting],
    *,
    target: str,
    map_view: MapView,
    params: ConsensusParams,
) -> tuple[ObjectCandidate, ...]:
    """The candidates after a frame in which other names may have been detected in their place.

    A candidate of which the frame holds a sighting (``seen``) stands: what lies on it or before
    it does not speak against it.
    """
    others = [
        map_view.world_cells(map_view.grid.cells(_points(detections, index)))
        for index, name in enumerate(detections.names)
        if not same_name(name, target)
    ]
    return tuple(
        replace(candidate, contradictions=candidate.contradictions + 1)
        if any(_overlap(cells, candidate.cells) for cells in others)
        and not any(is_same_object(candidate, sighting, params) for sighting in seen)
        else candidate
        for candidate in candidates
    )


def means_same(one: str, other: str, synonyms: Synonyms) -> bool:
    """Whether two names are one, or mean the same."""
    return same_name(one, other) or frozenset((normalised(one), normalised(other))) in synonyms


def _overlap(one: WorldCells, other: WorldCells) -> bool:
    smaller = min(len(one), len(other))
    return smaller > 0 and len(one & other) >= SAME_PLACE * smaller


def _points(detections: Detections, index: int) -> F64:
    """Points (K, 3) float64 of one detection, metres in the map frame."""
    points: F64 = detections.points_map[detections.point_owner == index].astype(np.float64)
    return points
