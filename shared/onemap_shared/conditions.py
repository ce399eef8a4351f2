"""Whether a thing is as it was described: one check for the query and for the search.

A relation holds if the probability of the anchor times the kernel of the joint belief is half or
more for a cell of the thing. It is left to check where a cell may be the anchor, where the map
alone shows the anchor of "next to", a little beyond its reach, or where the relation does not hold
and floor around the thing was not seen yet; on and under hold where both heights are known. Whether
a thing is outside of a place that the map does not show is not known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf, isfinite, nan
from types import MappingProxyType

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from onemap_shared.geometry import F32, F64, I64, U8, Bool
from onemap_shared.grid import GridSpec, area_mask, onto
from onemap_shared.joint_belief import FADE_M, REACH_M, kernel
from onemap_shared.messages import (
    NO_ROOM,
    CheckedCondition,
    Detail,
    Holds,
    KeptObject,
    MapPlaces,
    Occupancy,
    Place,
    Relation,
    RelationKind,
)
from onemap_shared.names import definite, same_name, with_article
from onemap_shared.places import (
    NAMED_M,
    SPECK_M,
    near_cells,
    place_of,
    room_at,
    room_beside,
    rooms_at,
)
from onemap_shared.sight import in_sight

LIKELY = 0.5  # of the kernel times a probability, or of a thing's cells
UNLIKE = 0.1  # likeness of its cells' colours below which a thing has another one
MAYBE = 0.3  # of a probability: a cell of it may show the thing
SLACK_M = 0.1  # of heights: a cushion lies hardly higher than the middle of its sofa
NOT_SHOWN = "the map does not show where that is"
NOT_SETTLED = "its walls are not all seen yet"
ACROSS_M = 1.0  # half of the widest passage that parts two rooms, and a wall
ROUNDING_M = 0.05  # half a cell
UNSEEN_M2 = 0.3  # of floor around an object that may hide its anchor: a chair's


@dataclass(frozen=True, slots=True)
class Thing:
    """Something on the map: its cells (K, 2), and the height of its middle, NaN: not known."""

    cells: I64
    height_m: float = nan


def thing_of(kept: KeptObject, grid: GridSpec) -> Thing:
    """A find that the map keeps; without cells where it lies outside of the grid."""
    inside = area_mask(grid, kept.extent_m)
    cells = np.argwhere(inside) if inside is not None else np.empty((0, 2), np.int64)
    return Thing(cells, kept.position_m[2])


def things_of(
    finds: Sequence[KeptObject], names: Iterable[str], grid: GridSpec
) -> dict[str, list[Thing]]:
    """The finds of each of these names, on the map."""
    found = {name: [f for f in finds if same_name(f.name, name)] for name in names}
    placed = {name: [thing_of(each, grid) for each in kept] for name, kept in found.items()}
    return {name: [each for each in known if len(each.cells)] for name, known in placed.items()}


@dataclass(frozen=True, slots=True)
class Candidate:
    """A thing that may be what is sought.

    colour: whether it has the colour that is asked for, and why that is not known. alone: the
    detector alone takes it for the object, and lets the excluded names compete; the map does not.
    """

    thing: Thing
    colour: tuple[Holds, str] = (Holds.NOT_CHECKED, "no picture of it")
    alone: bool = False


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What the map shows beside the candidates, all (nx, ny) on ``grid``.

    similarity: probability of the object's name, with which the excluded ones compete, NaN where
    nothing was observed; anchors: the same of each anchor; things: anchors that were detected or
    found, by name. places: of the map; shown: the cells of each place that is named and shown;
    settled: of these, those that stay in it whatever is seen later, where there are some.
    likeness: of the colour that is asked for to that of each cell, NaN: not known; None: none is.
    height_m: of the middle of what the map shows on cells (K, 2), NaN: not known.
    """

    grid: GridSpec
    occupancy: U8
    explored: Bool
    similarity: F32
    anchors: Mapping[str, F32]
    places: MapPlaces
    shown: Mapping[str, Bool]
    settled: Mapping[str, Bool]
    things: Mapping[str, Sequence[Thing]] = field(default_factory=lambda: MappingProxyType({}))
    likeness: F32 | None = None
    height_m: Callable[[I64], float] = lambda _cells: nan


def check(
    candidate: Candidate, detail: Detail, around: Surroundings
) -> tuple[CheckedCondition, ...]:
    """The verdict on each condition of a description, with its evidence."""
    found = [_relation(each, candidate.thing, around) for each in detail.relations]
    found += _places(candidate.thing.cells, detail, around)
    if detail.colour:
        found.append(_colour(candidate, detail.colour, around))
    if detail.negatives:
        found.append(_excluded(candidate, detail.negatives, around))
    return tuple(found)


def is_excluded(conditions: Sequence[CheckedCondition], detail: Detail) -> bool:
    """Whether a checked thing is one of the names that a description excludes."""
    if not detail.negatives:
        return False
    none = _none_of(detail.negatives)
    return any(each.what == none and each.holds is Holds.NO for each in conditions)


def is_outline_open(conditions: Sequence[CheckedCondition]) -> bool:
    """Whether nothing is left to check but the walls of a room, and all else holds."""
    left = [each for each in conditions if each.holds is not Holds.YES]
    return bool(left) and all(each.evidence.endswith(NOT_SETTLED) for each in left)


def _none_of(negatives: Sequence[str]) -> str:
    return f"not {' or '.join(map(with_article, negatives))}"


@dataclass(frozen=True, slots=True)
class _Anchor:
    """What is an anchor, or may be one, by the probability of each of its cells; with the metres
    from each to the thing that is checked, and how far the relation holds there, all (K,).
    seen: it was detected or found; else the map alone shows it."""

    thing: Thing
    seen: bool
    probability: F64
    away_m: F64
    holds: F64

    @property
    def believed(self) -> F64:
        """Probability (K,) that the relation holds."""
        return self.probability * self.holds


def _relation(relation: Relation, thing: Thing, around: Surroundings) -> CheckedCondition:
    kind = relation.kind
    what = f"{kind.words} {' and '.join(map(with_article, relation.anchors))}"
    anchors = [_anchors(name, kind, thing, around) for name in relation.anchors]
    found = [_anchored(each) for each in anchors]
    believed, possible = (min(each[index] for each in found) for index in (0, 1))
    away_m = max(each[2] for each in found)
    if believed >= LIKELY and kind in (RelationKind.ON, RelationKind.UNDER):
        return _at_height(relation, thing, anchors[0], around)
    if believed >= LIKELY and _in_doubt(kind, away_m, anchors):
        nearest = f"{' or '.join(map(definite, relation.anchors))} is {away_m:.1f} m away"
        why = f"{nearest} on the map, which blurs by {FADE_M:g} m"
        return CheckedCondition(what, Holds.NOT_CHECKED, f"perhaps not {what}: {why}")
    if believed >= LIKELY:
        words = f"{away_m:.1f} m from" if kind is RelationKind.NEXT_TO else kind.words
        return CheckedCondition(
            what, Holds.YES, f"{words} {' and '.join(map(definite, relation.anchors))}"
        )
    if believed >= MAYBE or possible >= LIKELY:
        why = f"{' or '.join(map(definite, relation.anchors))} there was hardly seen"
        return CheckedCondition(what, Holds.NOT_CHECKED, f"perhaps not {what}: {why}")
    reach_m = REACH_M[kind] + FADE_M
    if away_m > REACH_M[kind] and _unseen_m2(thing.cells, around, reach_m) >= UNSEEN_M2:
        why = "not all around it was seen"
        return CheckedCondition(what, Holds.NOT_CHECKED, f"perhaps not {what}: {why}")
    nearest = f": the nearest is {away_m:.1f} m away" if isfinite(away_m) else ""
    return CheckedCondition(what, Holds.NO, f"not {what}{nearest}")


def _in_doubt(kind: RelationKind, away_m: float, anchors: Sequence[Sequence[_Anchor]]) -> bool:
    """Whether an anchor is beyond the reach by no more than the map blurs, and nothing but the map
    shows one so near."""
    seen = (each for known in anchors for each in known if each.seen)
    near = any(float(each.believed.max()) >= LIKELY for each in seen)
    return kind is RelationKind.NEXT_TO and away_m > REACH_M[kind] + ROUNDING_M and not near


def _anchors(
    name: str, kind: RelationKind, thing: Thing, around: Surroundings
) -> tuple[_Anchor, ...]:
    """What the map may show under a name, and what was detected or found, without what is behind
    a wall."""
    similarity = np.nan_to_num(around.anchors[name], nan=0.0).astype(np.float64)
    blobs, count = ndimage.label(similarity >= MAYBE, np.ones((3, 3)))
    shown = [np.argwhere(blobs == index) for index in range(1, count + 1)]
    anchors = [(Thing(each), False, similarity[tuple(each.T)]) for each in shown]
    anchors += [(each, True, np.ones(len(each.cells))) for each in around.things.get(name, ())]
    tree = cKDTree(thing.cells)
    found = []
    for each, seen, probability in anchors:
        if len(each.cells) and not _walled_off(thing.cells, each.cells, around):
            away_m = tree.query(each.cells)[0] * around.grid.cell_size_m
            found.append(_Anchor(each, seen, probability, away_m, kernel(kind, away_m)))
    return tuple(found)


def _anchored(anchors: Sequence[_Anchor]) -> tuple[float, float, float]:
    """Probability that the relation to an anchor holds, the same if all that may be one is, and
    metres to what speaks most for it, or without that to the nearest that is likely an anchor;
    infinity without any."""
    if not anchors:
        return 0.0, 0.0, inf
    believed = np.concatenate([each.believed for each in anchors])
    probability = np.concatenate([each.probability for each in anchors])
    away_m = np.concatenate([each.away_m for each in anchors])
    possible = max(float(each.holds.max()) for each in anchors)
    most = float(believed.max())
    telling = believed >= min(most, LIKELY) if most >= MAYBE else probability >= LIKELY
    return most, possible, float(away_m[telling].min(initial=inf))


def _walled_off(cells: I64, anchor: I64, around: Surroundings) -> bool:
    """Whether an anchor (M, 2) stands beside another room's floor than the cells (K, 2) do, and
    something between them hides it: a wall."""
    if len(anchor) == 0:
        return False
    rooms = [room_beside(around.places, around.grid, each) for each in (cells, anchor)]
    if NO_ROOM in rooms or rooms[0] == rooms[1]:
        return False
    away, nearest = cKDTree(anchor).query(cells)
    start, end = cells[away.argmin()], anchor[nearest[away.argmin()]]
    steps = np.linspace(start, end, 2 * int(np.abs(end - start).max()) + 1).round().astype(np.int64)
    own = {tuple(cell) for cell in np.vstack([cells, anchor])}
    return any(around.occupancy[x, y] == Occupancy.OCCUPIED for x, y in steps if (x, y) not in own)


def _at_height(
    relation: Relation, thing: Thing, anchors: Sequence[_Anchor], around: Surroundings
) -> CheckedCondition:
    """Whether it is as high as what lies on, or under, one of the anchors that it is at.

    The middle of what was seen of one is compared with that of the other, whose sides and legs are
    seen too: what lies on it is higher. Where no anchor was detected or found, the map may tell the
    height of what the thing does not cover of it.
    """
    kind, (name,) = relation.kind, relation.anchors
    what = f"{kind.words} {with_article(name)}"
    at = [each.thing for each in anchors if each.believed.max() >= LIKELY]
    heights_m = [each.height_m for each in at if isfinite(each.height_m)]
    if not heights_m:
        heights_m = [around.height_m(_uncovered(each.cells, thing.cells)) for each in at]
    above_m = [thing.height_m - each for each in heights_m if isfinite(each)]
    if not above_m or not isfinite(thing.height_m):
        whose = f"the height of {definite(name)}" if isfinite(thing.height_m) else "its height"
        return CheckedCondition(
            what, Holds.NOT_CHECKED, f"perhaps not {what}: {whose} is not known"
        )
    on = kind is RelationKind.ON
    if max(above_m) >= -SLACK_M if on else min(above_m) <= SLACK_M:
        return CheckedCondition(what, Holds.YES, f"{kind.words} {definite(name)}")
    side = "lower" if on else "higher"
    return CheckedCondition(what, Holds.NO, f"not {what}: it is {side} than the one there")


def _uncovered(cells: I64, others: I64) -> I64:
    """The cells (K, 2) that are none of the others."""
    taken = set(map(tuple, others.tolist()))
    left: I64 = np.array([each for each in cells.tolist() if tuple(each) not in taken], np.int64)
    return left.reshape(-1, 2)


def _unseen_m2(cells: I64, around: Surroundings, range_m: float) -> float:
    """Floor around the cells (K, 2) in sight of their middle that nobody has seen well."""
    grid = around.grid
    middle = cells[np.hypot(*(cells - cells.mean(axis=0)).T).argmin()]
    reach = int(range_m / grid.cell_size_m)
    first, side = middle - reach, 2 * reach + 1
    occupancy = np.full((side, side), Occupancy.UNKNOWN, np.uint8)
    unseen = np.ones((side, side), bool)
    (x0, y0), (x1, y1) = np.clip([first, first + side], 0, grid.shape)
    here = np.s_[x0 - first[0] : x1 - first[0], y0 - first[1] : y1 - first[1]]
    occupancy[here], unseen[here] = around.occupancy[x0:x1, y0:y1], ~around.explored[x0:x1, y0:y1]
    own = cells - first
    own = own[((own >= 0) & (own < side)).all(axis=1)]
    occupancy[tuple(own.T)] = Occupancy.FREE  # it does not hide its own surroundings
    return float((in_sight(occupancy) & unseen).sum()) * grid.cell_size_m**2


def _places(cells: I64, detail: Detail, around: Surroundings) -> Iterator[CheckedCondition]:
    held = place_of(around.places, around.grid, cells)
    here = held.name if held is not None else ""
    if detail.inside:
        what = f"in {' or '.join(map(definite, detail.inside))}"
        found = {_in_place(cells, name, held, around) for name in detail.inside}
        if Holds.YES in found:
            yield CheckedCondition(what, Holds.YES, what)
        elif found == {Holds.NO}:
            place = f": it is in {definite(here)}" if here else ""
            yield CheckedCondition(what, Holds.NO, f"not {what}{place}")
        else:
            why = NOT_SETTLED if Holds.NOT_CHECKED in found else NOT_SHOWN
            yield CheckedCondition(what, Holds.NOT_CHECKED, f"perhaps not {what}: {why}")
    for name in detail.outside:
        what, perhaps = f"not in {definite(name)}", f"perhaps in {definite(name)}"
        within = _in_place(cells, name, held, around)
        if within is Holds.YES:
            yield CheckedCondition(what, Holds.NO, f"in {definite(name)}")
        elif within is Holds.NO:
            place = "" if name in around.shown else f"in {definite(here)}, "
            yield CheckedCondition(what, Holds.YES, f"{place}{what}")
        else:
            why = NOT_SETTLED if within is Holds.NOT_CHECKED else NOT_SHOWN
            yield CheckedCondition(what, within, f"{perhaps}: {why}")


def _in_place(cells: I64, name: str, held: Place | None, around: Surroundings) -> Holds:
    """Whether the cells (K, 2) of a thing are in a place; held: as of ``place_of``.

    Not checked where unseen walls will tell; not known where the map does not show the place, and
    the thing is in none that a person named. What the map suggests may be half of a room that has
    two uses: it tells where a thing is, not where it is not.
    """
    if name in around.settled and _is_in(cells, around.settled[name], around):
        return Holds.YES
    if name in around.shown:
        return Holds.NOT_CHECKED if _may_be_in(cells, name, around) else Holds.NO
    if held is None or held.corners_m or held.suggested or same_name(held.name, name):
        return Holds.NOT_KNOWN
    return Holds.NO if _is_settled(cells, held, around) else Holds.NOT_CHECKED


def _is_settled(cells: I64, place: Place, around: Surroundings) -> bool:
    """Whether half of the floor beside the cells (K, 2), or the nearest, is in the part of a room
    that holds the point of its name."""
    places, near = around.places, near_cells(cells, around.grid)
    parts = replace(places, ids=places.parts)
    own = room_at(parts.ids, places.grid, place.inside_m, NAMED_M)
    floor = rooms_at(places, around.grid, near) != NO_ROOM
    if not floor.any():
        return own != NO_ROOM and room_beside(parts, around.grid, cells) == own
    return own != NO_ROOM and bool(
        (rooms_at(parts, around.grid, near)[floor] == own).mean() >= LIKELY
    )


def _may_be_in(cells: I64, name: str, around: Surroundings) -> bool:
    """Whether the cells (K, 2) may turn out to be in a place that the map shows: what was not seen
    lies between the floor beside them and its room, up to ``ACROSS_M`` from the floor of each."""
    if _is_in(cells, around.shown[name], around):
        return True
    places = around.places
    _, room = places.get(name) or (None, NO_ROOM)
    here = room_beside(places, around.grid, cells)
    if NO_ROOM in (room, here) or room == here:
        return room != NO_ROOM
    speck, across = (round(way_m / places.grid.cell_size_m) for way_m in (SPECK_M, ACROSS_M))
    seen = onto(places.grid, around.grid, around.occupancy, Occupancy.UNKNOWN) != Occupancy.UNKNOWN
    margin = 2 * across + speck
    x, y = np.nonzero(places.ids == room)
    window = np.s_[x.min() : x.max() + 2 * margin + 1, y.min() : y.max() + 2 * margin + 1]
    ids = np.pad(places.ids, margin, constant_values=NO_ROOM)[window]
    unseen = np.pad(~seen, margin, constant_values=True)[window]
    hidden = ndimage.binary_opening(unseen, np.ones((speck, speck)))
    one, other = (
        hidden & ndimage.binary_dilation(ids == each, iterations=across, mask=hidden)
        for each in (room, here)
    )
    return bool((one & ndimage.binary_dilation(other)).any())


def _is_in(cells: I64, mask: Bool, around: Surroundings) -> bool:
    """Whether half of the cells (K, 2) lie in a place (nx, ny), or as near as the map blurs, and
    half of the floor beside them: behind a wall is another room's."""
    near = near_cells(cells, around.grid)
    x, y = np.clip(near, 0, np.array(mask.shape) - 1).reshape(-1, 2).T
    held = mask[x, y].reshape(near.shape[:2]) & around.grid.contains(near)
    floor = rooms_at(around.places, around.grid, near) != NO_ROOM
    beside = held[floor].mean() if floor.any() else 1.0
    return bool(held.any(axis=1).mean() >= LIKELY and beside >= LIKELY)


def _colour(candidate: Candidate, colour: str, around: Surroundings) -> CheckedCondition:
    """By its picture. Where that does not tell, the mean colours of its cells, which mix with what
    is around it, tell what is not of the colour, but never that it is."""
    holds, why = candidate.colour
    alike = likeness_of(candidate.thing.cells, around)
    if holds is Holds.NOT_CHECKED and alike < UNLIKE:
        holds = Holds.NO
    if holds is Holds.NOT_CHECKED:
        likely = f"probably {colour} by the map's colours" if alike >= LIKELY else ""
        return CheckedCondition(colour, holds, f"{likely or f'perhaps not {colour}'}: {why}")
    return CheckedCondition(colour, holds, colour if holds is Holds.YES else f"not {colour}")


def likeness_of(cells: I64, around: Surroundings | None) -> float:
    """Of the colour that is asked for to that of most of the cells (K, 2); ``UNLIKE`` where none
    is, or the map does not tell."""
    if around is None or around.likeness is None:
        return UNLIKE
    return float(np.median(np.nan_to_num(around.likeness[tuple(cells.T)], nan=UNLIKE)))


def _excluded(
    candidate: Candidate, negatives: Sequence[str], around: Surroundings
) -> CheckedCondition:
    """They compete with the name on the map: where it loses, the thing is one of them.

    What the map does not agree with at all tells nothing of them; the detector lets them compete.
    """
    names, what = " or ".join(map(with_article, negatives)), _none_of(negatives)
    if candidate.alone:
        return CheckedCondition(what, Holds.YES, f"{what}, by the detector alone")
    similarity = around.similarity[tuple(candidate.thing.cells.T)]
    known: F64 = similarity[np.isfinite(similarity)].astype(np.float64)
    if not known.size:
        return CheckedCondition(
            what, Holds.NOT_CHECKED, f"perhaps {names}: the map shows neither there"
        )
    if float(np.median(known)) >= MAYBE:
        return CheckedCondition(what, Holds.YES, what)
    return CheckedCondition(what, Holds.NO, f"more like {names}")
