"""Where a region of an answer is, as people say it, and whether it is as it was described."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import dist, isfinite, nan

import numpy as np
from scipy.spatial import cKDTree

from onemap_mapper.belief.version import MapVersion
from onemap_mapper.query.regions import region_bands
from onemap_mapper.query.scores import ScoredVersion
from onemap_shared.conditions import (
    LIKELY,
    SLACK_M,
    Candidate,
    Surroundings,
    Thing,
    check,
    thing_of,
)
from onemap_shared.geometry import F32, I64
from onemap_shared.grid import GridSpec
from onemap_shared.messages import (
    Holds,
    KeptObject,
    MapPlaces,
    RelationKind,
    SimilarityRequest,
    Whereabouts,
)
from onemap_shared.messages.details import NEXT_TO_M
from onemap_shared.messages.objects import MAX_WHERE_CHARS
from onemap_shared.names import same_name
from onemap_shared.places import NOWHERE, place_of

# What people say where a thing is by: large, and rarely moved.
LANDMARKS = (
    *("bed", "sofa", "desk", "dining table", "coffee table", "television", "wardrobe"),
    *("bookshelf", "refrigerator", "stove", "sink", "toilet", "bathtub", "window"),
)
LEAST_CELLS = 4  # of what the map likely shows: fewer are noise
SAME_OBJECT_M = 1.0  # from the middle of a region to that of a find: half of what a bed moves
NO_PICTURE = (Holds.NOT_CHECKED, "its picture was not looked at")  # of the colour


@dataclass(frozen=True, slots=True)
class Knowledge:
    """What is known beside the map's features: its places, and what was found."""

    places: MapPlaces = NOWHERE
    finds: tuple[KeptObject, ...] = ()


NOTHING_KNOWN = Knowledge()


@dataclass(frozen=True, slots=True)
class Landmark:
    """A thing by which others are described: its name and where it is."""

    name: str
    thing: Thing


def middle_m(version: MapVersion, cells: I64) -> float:
    """Height of the middle of what lies on cells (K, 2), NaN: not known."""
    if len(cells) == 0:
        return nan
    band = region_bands(version, [cells], np.broadcast_to(np.float32(1), version.grid.shape))[0]
    return float(band.mean())


def whereabouts(
    version: MapVersion,
    request: SimilarityRequest,
    regions: Sequence[I64],
    around: Surroundings | None,
    *,
    known: Knowledge,
    landmarks: Mapping[str, F32],
) -> tuple[Whereabouts, ...]:
    """Of the regions, cells (K, 2) each, of an answer.

    around: what the request's detail is checked by, None: it says nothing; landmarks: similarity
    (nx, ny) of names that the map may show. What a search found there is checked as it was seen.
    """
    grid, name = version.grid, request.text
    detail = replace(request.detail, negatives=request.negatives)
    found = [Landmark(each.name, thing_of(each, grid)) for each in known.finds]
    answers = []
    for cells in regions:
        thing = Thing(cells, middle_m(version, cells))
        x_m, y_m = grid.centres(cells).mean(axis=0).tolist()
        place = place_of(known.places, grid, cells)
        near = [*found, *_shown(version, cells, landmarks)]
        relation, landmark = _beside(name, thing, near, grid)
        object_id = _found_here(name, (x_m, y_m), known.finds)
        kept = (thing_of(each, grid) for each in known.finds if each.object_id == object_id)
        seen = next((each for each in kept if len(each.cells)), thing)
        answers.append(
            Whereabouts(
                place.name if place is not None else "",
                relation,
                landmark,
                object_id,
                check(Candidate(seen, NO_PICTURE), detail, around) if around else (),
            )
        )
    return tuple(answers)


def where_found(
    scored: ScoredVersion, finds: Sequence[KeptObject], known: Knowledge
) -> list[KeptObject]:
    """The finds with where each is, in words.

    scored: of the newest map, with the scores of the landmarks that it may show.
    """
    version, grid = scored.version, scored.version.grid
    shows = [text for text in scored.texts if text.query.has_probabilities]
    landmarks = {text.query.text: version.to_grid(text.scores) for text in shows}
    found = [Landmark(each.name, thing_of(each, grid)) for each in known.finds]
    told = []
    for kept in finds:
        thing = thing_of(kept, grid)
        place = place_of(known.places, grid, thing.cells)
        relation, landmark = RelationKind.NEXT_TO, ""
        if len(thing.cells):
            near = [*found, *_shown(version, thing.cells, landmarks)]
            relation, landmark = _beside(kept.name, thing, near, grid)
        words = Whereabouts(place.name if place else "", relation, landmark).in_words
        told.append(replace(kept, where=words if len(words) <= MAX_WHERE_CHARS else ""))
    return told


def _shown(version: MapVersion, cells: I64, landmarks: Mapping[str, F32]) -> list[Landmark]:
    """What the map likely shows within reach of these cells."""
    reach = round(NEXT_TO_M / version.grid.cell_size_m)
    low = np.maximum(cells.min(axis=0) - reach, 0)
    high = cells.max(axis=0) + reach + 1
    window = np.s_[low[0] : high[0], low[1] : high[1]]
    shown = []
    for name, similarity in landmarks.items():
        there = np.argwhere(np.nan_to_num(similarity[window], nan=0.0) >= LIKELY) + low
        if len(there) >= LEAST_CELLS:
            shown.append(Landmark(name, Thing(there, middle_m(version, there))))
    return shown


def _beside(
    name: str, thing: Thing, landmarks: Sequence[Landmark], grid: GridSpec
) -> tuple[RelationKind, str]:
    """The landmark by which a thing is described, and how it lies to it; empty: none is near.

    One that covers half of it holds it, or stands on it, if their heights tell; else it may be the
    same thing by another name.
    """
    tree, here = cKDTree(thing.cells), set(map(tuple, thing.cells.tolist()))
    best: tuple[float, RelationKind, str] = (NEXT_TO_M, RelationKind.NEXT_TO, "")
    for each in landmarks:
        if same_name(each.name, name) or len(each.thing.cells) == 0:
            continue
        away_m = float(tree.query(each.thing.cells)[0].min()) * grid.cell_size_m
        kind = RelationKind.NEXT_TO
        if len(here & set(map(tuple, each.thing.cells.tolist()))) >= LIKELY * len(here):
            above_m = thing.height_m - each.thing.height_m
            if not (isfinite(above_m) and abs(above_m) >= SLACK_M):
                continue
            kind = RelationKind.ON if above_m > 0 else RelationKind.UNDER
            away_m = -1.0  # says more than what is beside
        if away_m <= best[0]:
            best = (away_m, kind, each.name)
    return best[1:]


def _found_here(name: str, xy_m: tuple[float, float], finds: Sequence[KeptObject]) -> str:
    """The id of the find of this name that is nearest; empty if none is here."""
    near = [
        (dist(each.position_m[:2], xy_m), each.object_id)
        for each in finds
        if same_name(each.name, name)
    ]
    away_m, object_id = min(near, default=(np.inf, ""))
    return object_id if away_m <= SAME_OBJECT_M else ""
