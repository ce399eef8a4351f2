"""What other names say of an object: those that compete with it, and what was found under them.

Other names of the search compete cell by cell on the map and detection by detection; objects
found before compete too: a bed that was confirmed is not found again as a sofa.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

import numpy as np

from onemap_planner.policy.state import NO_SYNONYMS, FoundObject, PlannerState, Synonyms
from onemap_planner.world.candidates import ObjectCandidate, Sighting, is_same_object
from onemap_planner.world.map_view import MapView, WorldCells
from onemap_shared.geometry import F64
from onemap_shared.messages import MAX_RIVALS, Detections, SearchViewRequest, TextEmbeddings
from onemap_shared.names import normalised, same_name

# Two sets of cells overlap if they share this part of the smaller one. A pillow on a bed does
# not: its cells never resembled the bed.
SAME_PLACE = 0.5


def synonyms_of(embeddings: TextEmbeddings) -> Synonyms:
    """Pairs among the texts that mean the same to the encoder."""
    pairs = np.argwhere(np.triu(embeddings.same_meaning(), 1))
    texts = [normalised(text) for text in embeddings.texts]
    return frozenset(frozenset((texts[one], texts[other])) for one, other in pairs)


def rival_names(
    target: str,
    objects: Iterable[str],
    found_objects: Iterable[FoundObject],
    synonyms: Synonyms = NO_SYNONYMS,
) -> tuple[str, ...]:
    """Names that compete with the target: of the search, then of found objects, newest first."""
    newest_first = reversed([found_object.name for found_object in found_objects])
    names = dict.fromkeys((*objects, *newest_first))
    return tuple(n for n in names if not means_same(n, target, synonyms))[:MAX_RIVALS]


def view_request(state: PlannerState) -> SearchViewRequest:
    """What the map is asked for the present object, or for a drive, which needs no similarity."""
    search = state.search
    if not search.target:
        return SearchViewRequest()
    rivals = rival_names(search.target, search.objects, state.found_objects, state.synonyms)
    detail = search.detail
    return SearchViewRequest(search.target, rivals, detail.negatives, detail.colour)


def found_under_other_names(
    found_objects: Iterable[FoundObject], target: str, synonyms: Synonyms
) -> tuple[FoundObject, ...]:
    """The found objects whose names do not mean the target."""
    return tuple(c for c in found_objects if not means_same(c.name, target, synonyms))


def conflicting_object(
    candidate: ObjectCandidate, found_objects: Iterable[FoundObject], map_view: MapView
) -> FoundObject | None:
    """The found object of another name that the candidate is; None if it is none of them.

    It is if their cells overlap and if, averaged over the cells of both, another name is more
    similar to the map than the target.
    """
    for found_object in found_objects:
        if not _overlap(found_object.cells, candidate.cells):
            continue
        cells = map_view.indices_of(candidate.cells | found_object.cells)
        margin = map_view.margin[cells[:, 0], cells[:, 1]]
        contested = margin[np.isfinite(margin)]
        if contested.size and contested.mean() < 0:
            return found_object
    return None


def found_object_at(
    cell: tuple[int, int], found_objects: Sequence[FoundObject]
) -> FoundObject | None:
    """The newest of these found objects that a world cell supported."""
    return next(
        (found_object for found_object in reversed(found_objects) if cell in found_object.cells),
        None,
    )


def count_contradictions(
    candidates: tuple[ObjectCandidate, ...],
    detections: Detections,
    sightings: Sequence[Sighting],
    *,
    names: Collection[str],
    map_view: MapView,
) -> tuple[ObjectCandidate, ...]:
    """The candidates, with the frames counted in which another name was detected there.

    names: of the target, and of what it may stand on.
    A frame with a sighting of the candidate, among ``sightings``, is not counted: the other
    detection lies on the object or before it.
    """
    others = [
        map_view.world_cells(map_view.grid.cells(_points(detections, index)))
        for index, name in enumerate(detections.names)
        if not any(same_name(name, own) for own in names)
    ]
    return tuple(
        replace(candidate, contradictions=candidate.contradictions + 1)
        if any(_overlap(cells, candidate.cells) for cells in others)
        and not any(is_same_object(candidate, sighting) for sighting in sightings)
        else candidate
        for candidate in candidates
    )


def means_same(one: str, other: str, synonyms: Synonyms) -> bool:
    """Whether two names are equal or synonyms."""
    return same_name(one, other) or frozenset((normalised(one), normalised(other))) in synonyms


def _overlap(one: WorldCells, other: WorldCells) -> bool:
    smaller = min(len(one), len(other))
    return smaller > 0 and len(one & other) >= SAME_PLACE * smaller


def _points(detections: Detections, index: int) -> F64:
    """Points (K, 3) float64 of one detection, metres in the map frame."""
    points: F64 = detections.points_map[detections.point_owner == index].astype(np.float64)
    return points
