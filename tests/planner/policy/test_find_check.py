"""The check of a find: distances and heights of its anchors, its place, its colour."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.find_check import check_find
from onemap_planner.policy.state import Evidence, FoundObject
from onemap_planner.policy.tell import finds_of, not_found, other_object
from onemap_planner.search.state_machine import Ending, EventStamp
from onemap_planner.world.candidates import ObjectCandidate, PictureOfObject
from onemap_planner.world.description import described
from onemap_shared import messages as m
from onemap_shared.places import NOWHERE
from tests.planner.drawn_maps import detections_of
from tests.planner.one_room import POSE, ROOM, candidate, context, having_seen, planner_state

DEN = ((0.0, 0.0), (2.0, 0.0), (2.0, 4.0), (0.0, 4.0))
NEXT_TO, ON, UNDER = m.RelationKind.NEXT_TO, m.RelationKind.ON, m.RelationKind.UNDER


YES, NO = m.Holds.YES, m.Holds.NO
NOT_CHECKED, NOT_KNOWN = m.Holds.NOT_CHECKED, m.Holds.NOT_KNOWN
Checked = tuple[m.Holds, tuple[str, ...], tuple[str, ...]]  # and what holds, and what does not


def checked(
    thing: ObjectCandidate,
    here: PlanningContext,
    evidence: Evidence | None = None,
    found: Sequence[FoundObject] = (),
) -> Checked:
    conditions = check_find(thing, here, evidence or Evidence(), found)
    return m.all_hold(conditions), m.evidence_for(conditions), m.evidence_missing(conditions)


def related(kind: m.RelationKind) -> m.Detail:
    return m.Detail(relations=(m.Relation(kind, ("bed",)),))


def seen_in_room(
    detail: m.Detail, places: m.MapPlaces = NOWHERE, shown: float = 0.9
) -> PlanningContext:
    """The room, in which a bed shows from (2, 2) to (3, 3)."""
    here = context()
    bed = np.full(ROOM.grid.shape, 0.05, np.float32)
    bed[20:30, 20:30] = shown
    views = [replace(ROOM, text=name, similarity=bed) for name in detail.anchors]
    return replace(here, description=described(detail, views, places, here.map_view, POSE.xy))


PERHAPS, BLURS = "perhaps not next to a bed", "which blurs by 0.25 m"


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        (1.45, (YES, ("0.6 m from the bed",), ())),
        (1.05, (YES, ("1.0 m from the bed",), ())),
        (0.85, (NOT_CHECKED, (), (f"{PERHAPS}: the bed is 1.2 m away on the map, {BLURS}",))),
        (0.65, (NO, (), ("not next to a bed: the nearest is 1.4 m away",))),
    ],
)
def test_a_lamp_is_next_to_the_bed_within_a_metre(x: float, expected: Checked) -> None:
    assert checked(candidate(x, 2.45), seen_in_room(related(NEXT_TO))) == expected


@pytest.mark.parametrize(("shown", "holds"), [(0.6, YES), (0.4, NOT_CHECKED), (0.2, NO)])
def test_an_anchor_that_shows_weakly_is_looked_at_more_closely(
    shown: float, holds: m.Holds
) -> None:
    here = seen_in_room(related(NEXT_TO), shown=shown)
    assert checked(candidate(1.45, 2.45), here)[0] is holds


def test_an_anchor_that_was_found_counts_and_the_unseen_may_hold_one() -> None:
    here, lamp = seen_in_room(related(NEXT_TO)), candidate(0.65, 2.45)
    found = FoundObject("bed", frozenset({(6, 33)}))
    assert checked(lamp, here, found=[found])[1] == ("0.9 m from the bed",)
    map_view = here.map_view
    occupancy, explored = map_view.occupancy.copy(), map_view.explored.copy()
    x, y = map_view.indices_of(frozenset({(x, y) for x in range(5, 12) for y in range(28, 34)})).T
    occupancy[x, y], explored[x, y] = m.Occupancy.UNKNOWN, False
    here = replace(here, map_view=replace(map_view, occupancy=occupancy, explored=explored))
    unseen = "perhaps not next to a bed: not all around it was seen"
    assert checked(lamp, here) == (NOT_CHECKED, (), (unseen,))


@pytest.mark.parametrize(("shown", "holds"), [(0.4, YES), (0.2, NO)])
def test_detections_of_an_anchor_settle_what_the_map_leaves_open(
    shown: float, holds: m.Holds
) -> None:
    here = seen_in_room(related(NEXT_TO), shown=shown)
    evidence = Evidence(anchors={"bed": (candidate(2.05, 2.45),)})
    assert checked(candidate(1.45, 2.45), here, evidence)[0] is holds


@pytest.mark.parametrize("x", [1.45, 1.05, 0.85, 0.75])
@pytest.mark.parametrize("shown", [0.9, 0.4, 0.3])
def test_what_detections_would_settle_a_query_leaves_open(x: float, shown: float) -> None:
    """The query has the map alone: it does not say no to what a search finds there."""
    here = seen_in_room(related(NEXT_TO), shown=shown)
    evidence, thing = Evidence(anchors={"bed": (candidate(2.05, 2.45),)}), candidate(x, 2.45)
    if checked(thing, here, evidence)[0] is YES:
        certain = shown > 0.5 and x > 1.0
        assert checked(thing, here)[0] is (YES if certain else NOT_CHECKED)


@pytest.mark.parametrize(
    ("kind", "z", "holds"),
    [(ON, 0.7, True), (ON, 0.1, False), (UNDER, 0.1, True), (UNDER, 0.7, False)],
)
def test_heights_tell_on_from_under(kind: m.RelationKind, z: float, holds: bool) -> None:
    bed = replace(candidate(2.45, 2.45), xyz=(2.45, 2.45, 0.4))
    lamp = replace(candidate(2.25, 2.25), xyz=(2.25, 2.25, z))
    here, side = seen_in_room(related(kind)), "lower" if kind is ON else "higher"
    expected = (
        (YES, (f"{kind} the bed",), ())
        if holds
        else (NO, (), (f"not {kind} a bed: it is {side} than the one there",))
    )
    assert checked(lamp, here, Evidence(anchors={"bed": (bed,)})) == expected
    state = replace(planner_state(), search=replace(planner_state().search, objects=("bed",)))
    state.find(bed)
    assert checked(lamp, here, found=state.found_objects) == expected


@pytest.mark.parametrize("kind", [ON, UNDER])
def test_on_and_under_what_was_not_detected_is_not_checked(kind: m.RelationKind) -> None:
    """The map shows the bed under it, without a height; another one was detected far away."""
    here, lamp = seen_in_room(related(kind)), candidate(2.25, 2.25)
    expected = (
        (NOT_CHECKED, (), (f"perhaps not {kind} a bed: the height of the bed is not known",)),
    )
    far = replace(candidate(3.45, 3.45), xyz=(3.45, 3.45, 0.4))
    for evidence in (Evidence(), Evidence(anchors={"bed": (far,)})):
        assert (checked(lamp, here, evidence),) == expected
    found = FoundObject("bed", frozenset({(22, 22)}))
    assert (checked(lamp, here, found=[found]),) == expected


def test_anchors_that_the_camera_saw_are_taken_in_and_named() -> None:
    here, state = seen_in_room(related(NEXT_TO)), planner_state()
    frame = detections_of({"bed": [(2.45, 2.45, 0.4), (2.55, 2.45, 0.4)]})
    after = having_seen(state, (frame, frame, frame), here)
    (bed,) = after.evidence.anchors["bed"]
    assert bed.sightings == 3
    assert after.landmarks(here).where((2.0, 2.0)) == "near the bed"
    assert state.evidence.anchors == {}


@pytest.mark.parametrize(
    ("detail", "x", "expected"),
    [
        (m.Detail(inside=("den",)), 1.0, (YES, ("in the den",), ())),
        (m.Detail(inside=("den",)), 3.0, (NO, (), ("not in the den",))),
        (m.Detail(outside=("den",)), 1.0, (NO, (), ("in the den",))),
        (m.Detail(outside=("den",)), 3.0, (YES, ("not in the den",), ())),
    ],
)
def test_a_place_holds_it_or_not(detail: m.Detail, x: float, expected: Checked) -> None:
    den = m.Place("den", corners_m=DEN)
    ids = np.full(ROOM.grid.shape, m.NO_ROOM, np.int32)
    places = m.MapPlaces(1, 1, (den,), (m.NO_ROOM,), ROOM.grid, ids)
    assert checked(candidate(x, 2.0), seen_in_room(detail, places)) == expected


def test_what_was_explored_of_a_place_is_told_of_it() -> None:
    ids = np.full(ROOM.grid.shape, m.NO_ROOM, np.int32)
    places = m.MapPlaces(1, 1, (m.Place("den", corners_m=DEN),), (m.NO_ROOM,), ROOM.grid, ids)
    detail, state = m.Detail(inside=("den",)), planner_state()
    state.search = replace(state.search, details=(detail,))
    ending = not_found(state, seen_in_room(detail, places)).event
    assert isinstance(ending, Ending)
    assert ending.reason.startswith("searched everything reachable in the den: 8 m² explored")


def test_a_search_that_finds_none_says_of_each_that_was_seen_what_is_wrong() -> None:
    red, blue = pictured(RGB["red"]), pictured((30, 60, 190))
    once = replace(blue, xyz=(3.0, 3.0, 0.5), cells=frozenset({(30, 30)}), sightings=1)
    far = replace(blue, xyz=(3.0, 1.0, 0.5), cells=frozenset({(30, 10)}), sightings=9)
    state = planner_state(blue, once)
    state.search = replace(state.search, details=(m.Detail(colour="red"),))
    here = seen_in_room(m.Detail(colour="red"))
    state.evidence.takes_any = True
    state.pass_by(far, "not red")
    state.reject(far, "no way leads to it")
    ending = not_found(state, here).event
    assert isinstance(ending, Ending)
    told = "at (3.0, 1.0) (not red; no way leads to it), at (1.0, 2.0) and (3.0, 3.0) (not red)"
    assert f"; left aside: {told}" in ending.reason
    assert len(state.search.passed) == 3
    state.evidence.candidates = (red,)
    state.search = replace(state.search, passed=())
    ending = not_found(state, here).event
    assert isinstance(ending, Ending)
    assert "left aside" not in ending.reason


@pytest.mark.parametrize(("likeness", "told"), [(0.05, True), (0.5, False), (np.nan, False)])
def test_the_best_match_that_has_another_colour_is_told_of(likeness: float, told: bool) -> None:
    here, state = seen_in_room(m.Detail(colour="red")), planner_state()
    state.search = replace(state.search, details=(m.Detail(colour="red"),))
    likenesses = np.full(here.map_view.grid.shape, likeness, np.float32)
    here = replace(here, map_view=replace(here.map_view, likeness=likenesses))
    ending = not_found(state, here).event
    assert isinstance(ending, Ending)
    assert ending.reason.endswith(", which is not red by the map's colours") == told


def test_whether_it_is_in_a_room_that_the_map_does_not_show_yet_cannot_be_told() -> None:
    attic, den = m.Place("attic", inside_m=(30.0, 30.0)), m.Place("den", corners_m=DEN)
    ids = np.full(ROOM.grid.shape, 0, np.int32)
    places = m.MapPlaces(1, 1, (attic, den), (m.NO_ROOM, m.NO_ROOM), ROOM.grid, ids)

    def placed(detail: m.Detail, x: float) -> Checked:
        return checked(candidate(x, 2.0), seen_in_room(detail, places))

    inside, nowhere = m.Detail(inside=("attic",), outside=("den",)), "the map does not show where"
    perhaps = (f"perhaps not in the attic: {nowhere} that is",)
    assert placed(inside, 3.0) == (NOT_CHECKED, ("not in the den",), perhaps)
    assert placed(inside, 1.0) == (NO, (), (*perhaps, "in the den"))
    perhaps = (f"perhaps in the attic: {nowhere} that is",)
    outside = placed(m.Detail(outside=("attic", "den")), 3.0)
    assert outside == (NOT_KNOWN, ("not in the den",), perhaps)


def test_what_is_in_a_room_with_a_name_is_in_no_other() -> None:
    ids = np.zeros(ROOM.grid.shape, np.int32)
    den = m.Place("den", inside_m=(1.0, 1.0))
    for suggested, inside, outside in ((False, NO, YES), (True, NOT_CHECKED, NOT_KNOWN)):
        room = replace(den, suggested=suggested)
        places = m.MapPlaces(1, 1, (room,), (0,), ROOM.grid, ids, parts=ids)
        for detail, holds in (
            (m.Detail(inside=("attic",)), inside),
            (m.Detail(outside=("attic",)), outside),
        ):
            assert checked(candidate(1.0, 2.0), seen_in_room(detail, places))[0] is holds


def test_what_loses_against_an_excluded_name_on_the_map_is_one_of_it() -> None:
    detail, there = m.Detail(negatives=("stool", "sofa")), candidate(1.0, 2.0)
    here = seen_in_room(detail)
    x, y = here.map_view.indices_of(there.surface).T
    for similarity, expected in (
        (0.8, (YES, ("not a stool or a sofa",), ())),
        (0.1, (NO, (), ("more like a stool or a sofa",))),
        (np.nan, (NOT_CHECKED, (), ("perhaps a stool or a sofa: the map shows neither there",))),
    ):
        seen = here.map_view.similarity.copy()
        seen[x, y] = similarity
        map_view = replace(here.map_view, similarity=seen)
        assert checked(there, replace(here, map_view=map_view)) == expected


def test_one_of_the_excluded_names_is_not_kept_under_the_name() -> None:
    detail, there = m.Detail(negatives=("stool",)), candidate(1.0, 2.0)
    state = planner_state()
    state.search = replace(state.search, details=(detail,))
    here = seen_in_room(detail)
    x, y = here.map_view.indices_of(there.surface).T
    for similarity, kept in ((0.1, False), (np.nan, True)):
        seen = here.map_view.similarity.copy()
        seen[x, y] = similarity
        here = replace(here, map_view=replace(here.map_view, similarity=seen))
        ending = other_object(state, there, check_find(there, here, Evidence()))
        after = state.copy()
        after.apply(ending, EventStamp(1.0, 1.0, (1.0, 1.0), 0.0))
        (result,) = after.search.results
        assert (result.outcome, result.position_m) == (m.SearchState.FOUND_OTHER, there.xyz)
        assert bool(after.found_objects) == kept
        assert bool(finds_of(state.search, [ending], ROOM.grid)) == kept


RGB = {"white": (235, 235, 230), "brown": (110, 70, 40), "red": (190, 30, 35)}


def pictured(rgb: tuple[int, int, int], wall: int = 200, side: int = 30) -> ObjectCandidate:
    """A candidate in a picture of a wall; with a rim of the wall in its box."""
    image = np.full((60, 80, 3), wall, np.uint8)
    image[20 : 20 + side, 30 : 30 + side] = rgb
    data = io.BytesIO()
    Image.fromarray(image).save(data, "JPEG", quality=90)
    view = PictureOfObject(0.9, 1, (28.0, 18.0, 32.0 + side, 22.0 + side), data.getvalue())
    return replace(candidate(1.0, 2.0), best_view=view)


@pytest.mark.parametrize("colour", RGB)
def test_a_colour_is_that_of_its_own_pixels(colour: str) -> None:
    here = seen_in_room(m.Detail(colour=colour))
    thing = pictured(RGB[colour])
    assert checked(thing, here) == (YES, (colour,), ())
    assert here.believed(here.map_view, drawn=True) is here.map_view  # it says nothing of where
    other = pictured(RGB["white" if colour == "red" else "red"])
    assert checked(other, here) == (NO, (), (f"not {colour}",))


def test_what_is_too_dark_or_too_far_is_not_judged() -> None:
    here = seen_in_room(m.Detail(colour="red"))
    dark, far = pictured((30, 30, 30), wall=35), pictured((30, 30, 30), side=4)
    for thing, why in (
        (dark, "it is too dark"),
        (far, "it was seen from too far"),
        (candidate(1.0, 2.0), "there is no picture of it"),
    ):
        assert checked(thing, here) == (NOT_CHECKED, (), (f"perhaps not red: {why}",))


def test_in_the_dark_the_map_tells_no_colour_either() -> None:
    here = seen_in_room(m.Detail(colour="black"))
    black = np.full(here.map_view.grid.shape, 0.9, np.float32)
    here = replace(here, map_view=replace(here.map_view, likeness=black))
    dark = pictured((15, 3, 3), wall=20)
    assert checked(dark, here) == (NOT_CHECKED, (), ("perhaps not black: it is too dark",))


@pytest.mark.parametrize(
    ("likeness", "holds", "said"),
    [
        (0.8, NOT_CHECKED, "probably red by the map's colours: there is no picture of it"),
        (0.3, NOT_CHECKED, "perhaps not red: there is no picture of it"),
        (np.nan, NOT_CHECKED, "perhaps not red: there is no picture of it"),
        (0.05, NO, "not red"),
    ],
)
def test_the_colours_of_the_map_exclude_and_never_confirm(
    likeness: float, holds: m.Holds, said: str
) -> None:
    here, thing = seen_in_room(m.Detail(colour="red")), candidate(1.0, 2.0)
    likenesses = np.full(here.map_view.grid.shape, likeness, np.float32)
    here = replace(here, map_view=replace(here.map_view, likeness=likenesses))
    assert checked(thing, here) == (holds, (), (said,))
