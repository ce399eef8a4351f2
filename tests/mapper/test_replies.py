"""Replies made from a small map in which half of the image shows a sofa."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.query.regions import extent_band
from onemap_mapper.query.replies import ViewReplies, judged, search_view, similarity_reply
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery
from onemap_mapper.query.verdicts import floor_coverage
from onemap_mapper.query.whereabouts import Knowledge, where_found
from onemap_mapper.storage.planar_motion import PlanarMotion
from onemap_mapper.storage.snapshot import merge_into, take
from onemap_planner.world.map_view import with_changes
from onemap_shared import messages as m
from onemap_shared.geometry import F32
from tests.mapper import scenes, table_room
from tests.mapper.table_room import FEATURES, NAMES

SOFA, WALL, CUP, HAT = np.eye(16, dtype=np.float32)[:4]


def query(text: str, direction: np.ndarray, *, min_score: float = 0.0) -> TextQuery:
    """A calibrated query that competes with walls."""
    concepts = torch.from_numpy(np.stack([direction, WALL]))
    return TextQuery(text, concepts, 30.0, min_score)


@pytest.fixture(scope="module")
def belief() -> BeliefMap:
    features = np.tile(WALL, (6, 8, 1))
    features[2:4, 3:5] = SOFA
    return scenes.mapped(*(scenes.field(k, scenes.pose(), features=features) for k in range(3)))


def replied(belief: BeliefMap, question: TextQuery, **request: object) -> m.SimilarityReply:
    return similarity_reply(
        MapScores(belief).of([question]),
        request=replace(m.SimilarityRequest(question.text), **request),  # type: ignore[arg-type]
    )


BESIDE_CUP = m.Detail(relations=(m.Relation(m.RelationKind.NEXT_TO, ("cup",)),))


@pytest.mark.parametrize(("cup", "found"), [(SOFA, True), (-SOFA, False)])
def test_a_thing_is_found_where_its_anchor_is(belief: BeliefMap, cup: F32, found: bool) -> None:
    """The cup is where the sofa is, or nowhere."""
    scored = MapScores(belief).of([query("sofa", SOFA), query("cup", cup)])
    reply = similarity_reply(scored, request=m.SimilarityRequest("sofa", detail=BESIDE_CUP))
    occupancy, layers = scored.version.occupancy_grid(), scored.version.layers()
    coverage = floor_coverage(occupancy, layers, reply.grid, robot_xy_m=(), area=None)
    reply = judged(reply, m.SimilarityRequest("sofa"), coverage, scored, found_score=0.5)
    assert reply.scores[0] > 0.8
    assert (reply.verdict.verdict is m.Verdict.FOUND) is found
    assert reply.whereabouts[0].holds is (m.Holds.YES if found else m.Holds.NOT_CHECKED)


def test_what_is_hardly_like_it_is_not_it_though_it_is_where_it_was_sought() -> None:
    """A curtain by the window, which is a little like a sofa; the sofa stands elsewhere."""
    features, curtain = np.tile(WALL, (6, 8, 1)), WALL + np.float32(0.95) * SOFA + 2 * HAT
    features[2:4, :2], features[2:4, 5:7] = curtain / np.linalg.norm(curtain), SOFA
    belief = scenes.mapped(*(scenes.field(k, scenes.pose(), features=features) for k in range(3)))
    on_window = m.Detail(relations=(m.Relation(m.RelationKind.ON, ("window",)),))
    scored = MapScores(belief).of([query("sofa", SOFA), query("window", HAT)])
    reply = similarity_reply(scored, request=m.SimilarityRequest("sofa", detail=on_window))
    assert reply.scores.min() > 0.5


def test_an_answer_is_said_by_room_landmark_and_find(belief: BeliefMap) -> None:
    scored = MapScores(belief).of([query("sofa", SOFA), query("desk", SOFA)])
    (x, y), grid = (
        similarity_reply(
            MapScores(belief).of([query("sofa", SOFA)]), request=m.SimilarityRequest("sofa")
        )
        .centres_m[0]
        .tolist(),
        scored.version.grid,
    )
    den = m.Place("den", inside_m=(x, y))
    places = m.MapPlaces(1, 1, (den,), (3,), grid, np.full(grid.shape, 3, np.int32))

    def find(name: str, object_id: str, x_m: float) -> m.KeptObject:
        extent_m = (x_m - 0.2, y - 0.2, x_m + 0.2, y + 0.2)
        return m.KeptObject(object_id, name, (x_m, y, 0.4), extent_m, 0.9, 1, "s", 1, 1)

    def said(*finds: m.KeptObject) -> m.Whereabouts:
        request, known = m.SimilarityRequest("sofa"), Knowledge(places, finds)
        return similarity_reply(
            scored, request=request, known=known, landmarks=["desk"]
        ).whereabouts[0]

    alone = said()  # what lies where the sofa is may be the sofa by another name
    assert (alone.in_words, alone.object_id) == ("in the den", "")
    both = said(find("lamp", "a", x + 0.9), find("Sofa", "b", x + 0.1), find("bed", "c", x - 2.0))
    assert (both.in_words, both.object_id) == ("in the den, next to the lamp", "b")
    finds = (find("lamp", "a", x + 0.9), find("sofa", "b", x + 0.1), find("bed", "c", x - 90.0))
    told = where_found(MapScores(belief).of([]), finds, Knowledge(places, finds))
    by_sofa, by_lamp = "in the den, next to the sofa", "in the den, next to the lamp"
    assert [each.where for each in told] == [by_sofa, by_lamp, ""]
    shown = where_found(MapScores(belief).of([query("desk", SOFA)]), finds[:1], Knowledge())
    assert [each.where for each in shown] == ["next to the desk"]


@pytest.mark.parametrize(("z_m", "holds"), [(0.8, m.Holds.YES), (0.0, m.Holds.NO)])
def test_what_a_search_found_is_checked_as_it_was_seen(
    belief: BeliefMap, z_m: float, holds: m.Holds
) -> None:
    scored = MapScores(belief).of([query("sofa", SOFA), query("cup", SOFA)])
    on_cup = m.Detail(relations=(m.Relation(m.RelationKind.ON, ("cup",)),))
    x, y = similarity_reply(scored, request=m.SimilarityRequest("sofa")).centres_m[0].tolist()
    extent_m = (x - 0.2, y - 0.2, x + 0.2, y + 0.2)
    finds = tuple(
        m.KeptObject(name, name, (x, y, z), extent_m, 0.9, 1, "s", 1, 1)
        for name, z in (("cup", 0.4), ("sofa", z_m))
    )
    request = m.SimilarityRequest("sofa", detail=on_cup)
    reply = similarity_reply(scored, request=request, known=Knowledge(finds=finds))
    assert reply.whereabouts[0].holds is holds


def test_places_limit_what_is_found(belief: BeliefMap) -> None:
    scored = MapScores(belief).of([query("sofa", SOFA)])
    plain = similarity_reply(scored, request=m.SimilarityRequest("sofa"))
    (x_m, y_m), ids = plain.centres_m[0].tolist(), np.full(plain.grid.shape, m.NO_ROOM, np.int32)
    here = ((x_m - 1, y_m - 1), (x_m + 1, y_m - 1), (x_m + 1, y_m + 1), (x_m - 1, y_m + 1))
    corner = m.Place("corner", corners_m=here)
    places = m.MapPlaces(1, 1, (corner,), (m.NO_ROOM,), plain.grid, ids)

    def asked(detail: m.Detail) -> m.SimilarityReply:
        request = m.SimilarityRequest("sofa", detail=detail)
        return similarity_reply(scored, request=request, known=Knowledge(places))

    inside = asked(m.Detail(inside=("corner",)))
    assert inside.scores[0] == pytest.approx(plain.best_score)
    assert (inside.whereabouts[0].holds, inside.whereabouts[0].in_words) == (
        m.Holds.YES,
        "in the corner",
    )
    assert asked(m.Detail(outside=("corner",))).best_score < 0.1


def test_regions_below_the_calibrated_score_are_left_out(belief: BeliefMap) -> None:
    reply = replied(belief, query("cup", CUP, min_score=0.6), include_grid=True)
    assert len(reply.scores) == len(reply.centres_m) == len(reply.extents_m) == 0
    assert reply.floor == 0.6
    assert 0 < reply.best_score < 0.6
    assert np.nanmax(reply.scores_grid) == pytest.approx(reply.best_score, abs=0.05)


@pytest.mark.parametrize(("direction", "found"), [(SOFA, True), (HAT, False)])
def test_without_labels_a_control_word_says_what_is_not_here(
    belief: BeliefMap, direction: F32, found: bool
) -> None:
    """Nothing is like the cup; a sofa that no word names is as much of a cup as of a hat."""
    words = torch.from_numpy(np.stack([direction, WALL, CUP]))
    fitted = TextQuery("x", words, 30.0, neutral=words[1:], excluded=torch.zeros(2), controls=1)
    scored = MapScores(belief).of([fitted])
    reply = similarity_reply(scored, request=m.SimilarityRequest("x"))
    occupancy, layers = scored.version.occupancy_grid(), scored.version.layers()
    coverage = floor_coverage(occupancy, layers, reply.grid, robot_xy_m=(), area=None)
    reply = judged(reply, m.SimilarityRequest("x"), coverage, scored, found_score=0.0)
    assert 0.4 < reply.floor < 0.6
    assert (reply.verdict.verdict is m.Verdict.FOUND) is found
    assert (len(reply.scores) > 0) is found
    assert not reply.calibrated


def test_guidance_ranks_the_observed_cells_where_the_score_is_zero(belief: BeliefMap) -> None:
    far_from_it = replace(query("sofa", SOFA), temperature=1e4)  # a score of 0 or 1 everywhere
    view = search_view(MapScores(belief).of([far_from_it]), text="sofa")
    observed = np.isfinite(view.similarity)
    assert ((view.guidance > 0) == observed).all()
    assert len(np.unique(view.guidance[observed])) > 10
    assert view.guidance[view.similarity > 0.9].min() > 200
    assert search_view(MapScores(belief).of([]), text="").guidance.shape == (0, 0)


@pytest.mark.parametrize("kind", ["calibrated", "by rank", "with controls"])
def test_negatives_change_the_view_and_its_changes_alike(belief: BeliefMap, kind: str) -> None:
    words = torch.from_numpy(np.stack([WALL, HAT]))

    def asked(text: str, direction: F32) -> TextQuery:
        own = torch.from_numpy(direction)[None]
        if kind == "by rank":
            return TextQuery(text, own, 30.0)
        if kind == "with controls":
            concepts = torch.cat([own, words])
            return TextQuery(
                text, concepts, 30.0, neutral=words, excluded=torch.zeros(2), controls=1
            )
        return query(text, direction)

    like_both = ((SOFA + WALL) / np.linalg.norm(SOFA + WALL)).astype(np.float32)
    texts = [asked("sofa", like_both), asked("wall", WALL)]
    whole = search_view(MapScores(belief).of(texts), text="sofa", negatives=1)
    request = m.ViewChangesRequest("sofa", negatives=("wall",))
    changes = ViewReplies(MapScores(belief), "map").reply(request, texts)
    found = with_changes(None, changes).whole()
    np.testing.assert_allclose(found.similarity, whole.similarity, atol=1e-6)
    np.testing.assert_array_equal(found.guidance, whole.guidance)
    plain = search_view(MapScores(belief).of(texts[:1]), text="sofa")
    assert np.nanmax(np.abs(plain.similarity - whole.similarity)) > 0.1


def test_a_text_asked_of_a_map_without_features_is_nowhere() -> None:
    blind = scenes.mapped(scenes.field(0, scenes.pose(), boxes=()))
    view = search_view(MapScores(blind).of([]), text="sofa")
    assert view.similarity.shape == view.grid.shape
    assert np.isnan(view.similarity).all()


def test_a_region_has_outline_view_and_time(belief: BeliefMap) -> None:
    reply = replied(belief, query("sofa", SOFA))
    assert set(reply.outline_owner.tolist()) == set(range(len(reply.scores)))
    corners = reply.outline_points_m[reply.outline_owner == 0]
    np.testing.assert_allclose(corners.min(axis=0), reply.extents_m[0, :2], atol=0.11)
    np.testing.assert_allclose(corners.max(axis=0), reply.extents_m[0, 2:], atol=0.11)
    camera_m = scenes.pose()[:2, 3]
    np.testing.assert_allclose(reply.best_views[0], [*camera_m, 0.0], atol=1e-5)
    assert (reply.last_seen_ns == belief.history().stamp_ns).all()


def test_only_the_area_that_was_asked_for_has_regions(belief: BeliefMap) -> None:
    everywhere = replied(belief, query("sofa", SOFA), include_grid=True)
    x, y = everywhere.centres_m[0]
    area_m = (float(x) - 0.2, float(y) - 0.2, float(x) + 0.2, float(y) + 0.2)
    near = replied(belief, query("sofa", SOFA), area_m=area_m, include_grid=True)
    assert near.best_score == pytest.approx(everywhere.best_score)
    assert 0 < np.isfinite(near.scores_grid).sum() <= 20
    elsewhere = replied(belief, query("sofa", SOFA), area_m=(90.0, 90.0, 91.0, 91.0))
    assert len(elsewhere.scores) == 0
    assert elsewhere.best_score == 0.0


# From which to which height the answer may reach, and which height it must hold, in metres.
LIES = {
    "table": (0.5, 0.9, 0.73),
    "cup": (0.7, 1.1, 0.85),
    "basket": (0.0, 0.5, 0.2),
    "rug": (0.0, 0.1, 0.0),
}


@pytest.fixture(scope="module")
def table_map() -> BeliefMap:
    return table_room.seen_map()


def competing(name: str) -> TextQuery:
    """The query for one of the things, which competes with all others."""
    index = NAMES.index(name)
    order = [index, *(k for k in range(len(NAMES)) if k != index)]
    return TextQuery(name, torch.from_numpy(FEATURES[order]), 10.0)


def asked(table_map: BeliefMap, name: str) -> m.SimilarityReply:
    """The best region of one of the things, which competes with all others."""
    request = m.SimilarityRequest(name, max_regions=1)
    return similarity_reply(MapScores(table_map).of([competing(name)]), request=request)


def related(
    table_map: BeliefMap, name: str, kind: m.RelationKind
) -> tuple[m.CheckedCondition, ...]:
    """What is answered of the best region of a thing on or under a table."""
    scored = MapScores(table_map).of([competing(name), competing("table")])
    detail = m.Detail(relations=(m.Relation(kind, ("table",)),))
    request = m.SimilarityRequest(name, max_regions=1, detail=detail)
    return similarity_reply(scored, request=request).whereabouts[0].conditions


def test_what_stands_under_a_table_is_not_on_it(table_map: BeliefMap) -> None:
    """Nothing was detected: the map tells the height of both."""
    (under,) = related(table_map, "basket", m.RelationKind.UNDER)
    assert under.holds is m.Holds.YES
    (on,) = related(table_map, "basket", m.RelationKind.ON)
    assert on.evidence == "not on a table: it is lower than the one there"
    (under,) = related(table_map, "cup", m.RelationKind.UNDER)
    assert under.holds is not m.Holds.YES


def assert_lies(name: str, band: np.ndarray) -> None:
    least, most, inside = LIES[name]
    low, high = band.tolist()
    assert least - 1e-6 <= low <= inside <= high <= most + 1e-6


@pytest.mark.parametrize("name", LIES)
def test_an_answer_says_where_in_height_the_match_lies(table_map: BeliefMap, name: str) -> None:
    reply = asked(table_map, name)
    middle = np.mean([(*box.low, *box.high) for box in table_room.THINGS[name]], axis=0)
    assert np.linalg.norm(reply.centres_m[0] - (middle[:2] + middle[3:5]) / 2) < 0.6
    assert_lies(name, reply.heights_m[0])


@pytest.mark.parametrize("name", ["cup", "basket"])
def test_an_object_lies_at_the_heights_of_its_extent(table_map: BeliefMap, name: str) -> None:
    (box,) = table_room.THINGS[name]
    band = extent_band(table_map.shared_version(), (*box.low[:2], *box.high[:2]))
    assert_lies(name, np.array(band))


def test_a_view_tells_walls_from_furniture_by_how_high_they_reach(table_map: BeliefMap) -> None:
    view = search_view(MapScores(table_map).of([]), text="")
    standing = view.occupancy == m.Occupancy.OCCUPIED
    assert (view.tops_dm[~standing] == 0).all()
    centres = view.grid.centres(np.argwhere(standing))
    tops = view.tops_dm[standing]
    (table, *_) = table_room.THINGS["table"]
    outside_m = np.maximum(table.low[:2] - centres, centres - table.high[:2]).max(axis=1)
    assert np.isin(tops[outside_m < 0], (8, 10)).mean() > 0.9  # in decimetres; with the cup
    assert (tops[outside_m > 0.3] > 10).mean() > 0.9


def test_heights_follow_a_merge(table_map: BeliefMap) -> None:
    merged = BeliefMap(scenes.params())
    turned = PlanarMotion(np.pi / 2, 3.0, 1.0)
    merge_into(merged, take(table_map), turned)
    merge_into(merged, take(table_map), turned)
    for name in LIES:
        assert_lies(name, asked(merged, name).heights_m[0])
