"""What fits another name better is not the object, and what was found is not found again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.inputs import Heard, hear_revision
from onemap_planner.policy.competition import (
    MAX_CLAIMS,
    Claim,
    claimant,
    contested,
    of_others,
    rivals_of,
    synonyms_of,
    with_claim,
)
from onemap_planner.policy.state import Mind, Quest
from onemap_planner.policy.verify import confirm
from onemap_planner.registry import Desk
from onemap_planner.search.phases import Confirmed, Confirming, Moment, Over
from onemap_planner.search.state_machine import begin
from onemap_planner.world.candidates import Candidate, Sighting, sightings_of
from onemap_planner.world.map_view import Belief, belief_around
from onemap_shared.messages import (
    MAX_RIVALS,
    Detections,
    MapRevision,
    SearchState,
    TextEmbeddings,
)
from tests.planner.drawn_maps import RULES, as_view, drawn
from tests.planner.grid_world import Run, World, in_four_rooms, start
from tests.planner.policy.test_verify import situation

MOMENT = Moment(0.0, 0.0, (1.0, 1.0), 0.0)
BED = frozenset((x, y) for x in range(4, 14) for y in range(4, 12))
BED_END = frozenset((x, y) for x in range(4, 8) for y in range(4, 12))
PILLOW = frozenset((x, y) for x in range(14, 16) for y in range(6, 9))


def candidate(cells: frozenset[tuple[int, int]], sightings: int = 3) -> Candidate:
    x, y = np.mean(sorted(cells), axis=0) / 10
    return Candidate((x, y, 0.5), cells, sightings, 0.9, 0.9, ((0.0, 0.0),))


def belief_where(own: dict[tuple[int, int], float], rival: dict[tuple[int, int], float]) -> Belief:
    """20 x 20 cells of 0.1 m with these scores of the target and of its best rival."""
    similarity, best = (np.full((20, 20), 0.05, np.float32) for _ in range(2))
    for cells, grid in ((own, similarity), (rival, best)):
        for cell, score in cells.items():
            grid[cell] = score
    return replace(drawn(*["." * 20] * 20), similarity=similarity, rival=best)


def message(**cells_of: frozenset[tuple[int, int]]) -> Detections:
    """One detection per name, a point in the middle of each of its cells."""
    points = [[(x + 0.5) / 10, (y + 0.5) / 10, 0.5] for c in cells_of.values() for x, y in c]
    owner = [i for i, cells in enumerate(cells_of.values()) for _ in cells]
    return Detections(
        sequence=1,
        stamp_ns=0,
        detector_id="test",
        names=tuple(cells_of),
        boxes_px=np.zeros((len(cells_of), 4), np.float32),
        scores=np.full(len(cells_of), 0.8, np.float32),
        points_map=np.array(points, np.float32).reshape(-1, 3),
        point_owner=np.array(owner, np.int32),
    )


def test_rivals_are_the_search_s_other_names_and_the_finds() -> None:
    claims = (Claim("Bed", BED), Claim("toilet", PILLOW), Claim("sofa", BED))
    assert rivals_of("sofa", ("bed", "Sofa", "desk"), claims) == ("bed", "desk", "toilet", "Bed")
    assert rivals_of("sofa", ("sofa",), ()) == ()
    many = tuple(f"thing {n}" for n in range(2 * MAX_RIVALS))
    assert rivals_of("sofa", many, ()) == many[:MAX_RIVALS]


def test_synonyms_are_no_rivals_and_keep_no_place_from_each_other() -> None:
    eye = np.eye(3, dtype=np.float32)
    spared = np.array([[0, 1, 1], [0, 1, 1], [1, 0, 1]], np.uint8)  # the third means another thing
    texts = ("Sofa", "couch", "bed")
    synonyms = synonyms_of(TextEmbeddings("e", "s", texts, eye, eye, spared, 20.0))
    assert synonyms == {frozenset(("sofa", "couch"))}
    claims = (Claim("couch", BED), Claim("bed", BED))
    assert rivals_of("sofa", ("sofa", "desk"), claims, synonyms) == ("desk", "bed")
    assert of_others(claims, "sofa", synonyms) == (claims[1],)
    alike = np.array([[1, 0, 0], [0.95, 0.31, 0], [0.8, 0.6, 0]], np.float32)
    none = np.zeros((0, 3), np.float32), np.zeros((3, 0), np.uint8)
    uncalibrated = TextEmbeddings("e", "s", texts, alike, *none, 20.0)
    assert synonyms_of(uncalibrated) == {frozenset(("sofa", "couch")), frozenset(("couch", "bed"))}


def test_a_detection_counts_only_where_its_name_fits_best() -> None:
    own = dict.fromkeys(BED, 0.6)
    for better, count in ((0.5, 1), (0.6, 1), (0.7, 0)):
        belief = belief_where(own, dict.fromkeys(BED, better))
        found = sightings_of(
            "sofa", message(sofa=BED), belief, seen_from=(0, 0), rules=RULES.consensus
        )
        assert len(found) == count


def test_the_place_of_a_find_belongs_to_it_where_its_name_fits_better() -> None:
    claims = (Claim("bed", BED),)
    # The end of the bed looks like a sofa, the bed as a whole does not.
    end = belief_where(dict.fromkeys(BED_END, 0.9), dict.fromkeys(BED - BED_END, 0.9))
    assert claimant(candidate(BED_END), claims, end) == claims[0]
    assert claimant(candidate(BED_END), (), end) is None
    # The find was the mistake: all of it looks like a sofa by now.
    wrong = belief_where(dict.fromkeys(BED, 0.9), dict.fromkeys(BED, 0.3))
    assert claimant(candidate(BED_END), claims, wrong) is None


def test_what_lies_beside_or_on_a_find_is_free() -> None:
    belief = belief_where(dict.fromkeys(PILLOW, 0.9), dict.fromkeys(BED, 0.9))
    assert claimant(candidate(PILLOW), (Claim("bed", BED),), belief) is None


def test_finds_are_remembered_up_to_a_limit_from_one_search_to_the_next() -> None:
    claims: tuple[Claim, ...] = ()
    for number in range(MAX_CLAIMS + 3):
        claims = with_claim(claims, str(number), candidate(PILLOW))
    assert len(claims) == MAX_CLAIMS
    assert claims[-1] == Claim(str(MAX_CLAIMS + 2), PILLOW)
    desk = Desk()
    desk.start("a", ("bed",), MOMENT, 0)
    taken = desk.mind
    assert taken is not None
    over = replace(taken.search, phase=Over(SearchState.FOUND))
    known = replace(taken, search=over, claims=(Claim("bed", BED),), known_m2=40.0)
    desk.put_back(taken, known)
    desk.start("b", ("sofa",), MOMENT, 0)
    assert desk.mind is not None
    assert (desk.mind.claims, desk.mind.known_m2) == ((Claim("bed", BED),), 40.0)
    desk.forget_finds()
    assert desk.mind.claims == ()


@pytest.mark.parametrize(
    ("revision", "frames", "another"),
    [
        pytest.param(11, 11, False, id="one frame more"),
        pytest.param(14, 13, False, id="some missed, one reset among them"),
        pytest.param(11, 0, True, id="cleared"),
        pytest.param(11, 500, True, id="another one loaded"),
        pytest.param(3, 3, True, id="the mapper began anew"),
    ],
)
def test_another_map_is_noticed_whatever_its_size(
    revision: int, frames: int, another: bool
) -> None:
    def told(revision: int, frames: int) -> MapRevision:
        return MapRevision(revision, 1, 1, "e", "s", frames, 10, 10, 1.0, 8.0)

    heard = hear_revision(Heard(), told(10, 10), 0.0)
    after = hear_revision(heard, told(revision, frames), 1.0)
    assert (after.maps > heard.maps) == another


@pytest.mark.parametrize(
    ("seen", "against"),
    [
        pytest.param({"bed": BED}, 1, id="another name in its place"),
        pytest.param({"bed": frozenset({(0, 0)})}, 0, id="another name elsewhere"),
        pytest.param({"sofa": BED, "bed": BED}, 0, id="seen itself in the same frame"),
        pytest.param({}, 0, id="nothing"),
    ],
)
def test_frames_that_show_another_name_there_count_against(
    seen: dict[str, frozenset[tuple[int, int]]], against: int
) -> None:
    belief = belief_where(dict.fromkeys(BED, 0.9), {})
    frame = message(**seen)
    own: tuple[Sighting, ...] = sightings_of(
        "sofa", frame, belief, seen_from=(0, 0), rules=RULES.consensus
    )
    (after,) = contested(
        (candidate(BED),), frame, own, target="sofa", belief=belief, rules=RULES.consensus
    )
    assert after.against == against


@pytest.mark.parametrize(("against", "sure"), [(5, True), (6, False)])
def test_it_is_not_confirmed_while_another_name_is_seen_as_often(against: int, sure: bool) -> None:
    then = candidate(PILLOW, 4)
    now = replace(then, sightings=10, against=against)
    mind = Mind(begin("id", ("sofa",), MOMENT, 0), Quest(candidates=(now,)))
    _, _, event = confirm(mind, Confirming(then, 0.0), situation(), RULES)
    assert event == (Confirmed(now) if sure else None)


class Confused(World):
    """The detector and the map take a bed for a sofa as well, a little less surely."""

    def mistake(self) -> None:
        self.plan.things.pop("sofa", None)
        self.likeness["sofa"] = self.likeness["bed"] * np.float32(0.9)

    def detect(self, text: str, seen: np.ndarray) -> Detections:
        detections = super().detect("bed" if text == "sofa" else text, seen)
        return replace(detections, names=tuple(text for _ in detections.names))


def confused(*objects: str) -> Run:
    plain = in_four_rooms()
    world = Confused(plain.plan, plain.pose)
    world.mistake()
    return start(world, *objects)


@pytest.mark.parametrize("objects", [("bed", "sofa"), ("sofa", "bed")])
def test_one_thing_is_not_found_under_two_names(objects: tuple[str, ...]) -> None:
    run = confused(*objects)
    search = run.until_over(400.0)
    outcomes = {result.name: result.outcome for result in search.results}
    assert outcomes == {"bed": SearchState.FOUND, "sofa": SearchState.NOT_FOUND}, run.reasons
    if objects[0] == "bed":
        assert "which is the bed found before" in search.results[1].reason


def test_a_find_of_an_earlier_search_keeps_its_place() -> None:
    run = confused("bed")
    run.until_over(200.0)
    assert [claim.name for claim in run.mind.claims] == ["bed"]
    moment = Moment(run.now_s, 0.0, run.world.pose.xy, run.world.odometer_m)
    later = replace(run, search=begin("search-2", ("sofa",), moment, 0))
    later.mind = replace(later.mind, claims=run.mind.claims)
    search = later.until_over(400.0)
    assert [result.outcome for result in search.results] == [SearchState.NOT_FOUND]


def test_a_map_that_begins_anew_frees_all_places() -> None:
    run = confused("bed", "sofa")
    while run.mind.search.index == 0:
        run.think()
    assert run.mind.claims
    run.world.forget()
    run.think()
    assert run.mind.claims == ()


def test_the_rival_s_score_survives_the_crop_around_the_robot() -> None:
    belief = belief_where({}, dict.fromkeys(BED, 0.7))
    view = replace(as_view(belief), rival=belief.rival)
    cropped = belief_around(view, np.array([0.5, 0.5]))
    x, y = np.array([5, 5]) - np.asarray(cropped.grid.origin_cell)
    assert cropped.rival[x, y] == pytest.approx(0.7)
    alone = belief_around(as_view(belief), np.array([0.5, 0.5]))
    assert np.isneginf(alone.rival).all()
