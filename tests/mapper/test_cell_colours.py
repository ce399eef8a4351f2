"""The mean colour of each cell: fused, merged, in files, and what it says of a coloured object."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from onemap_mapper.belief.cells import NOT_KNOWN, CellStore, FeatureShare
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.occupancy.heights import LEVELS
from onemap_mapper.query.replies import ViewReplies, judged, search_view, similarity_reply
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery
from onemap_mapper.query.verdicts import floor_coverage
from onemap_mapper.storage import map_file
from onemap_mapper.storage.planar_motion import PlanarMotion
from onemap_mapper.storage.snapshot import merge_into, restore, take
from onemap_planner.world.map_view import with_changes
from onemap_shared import messages as m
from onemap_shared.colours import lab_of, packed
from onemap_shared.geometry import F32
from tests.mapper import scenes

SOFA, WALL = np.eye(16, dtype=np.float32)[:2]
RED, BLUE, GREY = (
    lab_of(np.array(rgb, np.uint8)) for rgb in ((180, 30, 30), (40, 70, 180), 3 * [130])
)
CPU, FIRST = torch.device("cpu"), np.zeros(1, np.int64)
QUERY = TextQuery("sofa", torch.from_numpy(np.stack([SOFA, WALL])), 30.0, 0.25)


def seen(sequence: int, colour: F32 | None, x_m: float = 0.0) -> m.FeatureField:
    """A sofa of this colour, None: not told, before grey walls."""
    features = np.tile(WALL, (6, 8, 1))
    features[2:4, 3:5] = SOFA
    field = scenes.field(sequence, scenes.pose(x_m), features=features)
    if colour is None:
        return field
    colours = np.tile(GREY, (6, 8, 1))
    colours[1:5, 2:6] = colour
    return replace(field, colours=packed(colours))


def answer(belief: BeliefMap, colour: str) -> m.SimilarityReply:
    request = m.SimilarityRequest("sofa", detail=m.Detail(colour=colour))
    scored = MapScores(belief).of([QUERY])
    reply, version = similarity_reply(scored, request=request), scored.version
    coverage = floor_coverage(
        version.occupancy_grid(), version.layers(), reply.grid, robot_xy_m=(), area=None
    )
    return judged(reply, request, coverage, scored, found_score=0.3)


def test_a_mean_colour_of_one_colour_is_it_whatever_the_blur() -> None:
    field = replace(seen(0, None), colours=packed(np.tile(RED, (6, 8, 1))))
    colours = compute_update(field, scenes.params()).colours
    np.testing.assert_allclose(colours, np.tile(RED, (len(colours), 1)), atol=0.6)


def test_colours_are_fused_as_features_are() -> None:
    both = scenes.mapped(seen(0, RED), seen(1, BLUE)).store.colours
    one, other = (scenes.mapped(seen(0, colour)).store.colours for colour in (RED, BLUE))
    np.testing.assert_allclose(both, (one + other) / 2, atol=1e-3)


def test_a_view_without_colours_leaves_what_is_known_of_them() -> None:
    known = scenes.mapped(seen(0, RED)).store.colours
    np.testing.assert_array_equal(scenes.mapped(seen(0, RED), seen(1, None)).store.colours, known)
    np.testing.assert_array_equal(scenes.mapped(seen(0, None), seen(1, RED)).store.colours, known)


def test_patches_without_a_colour_take_none_from_their_cells() -> None:
    field, lab = seen(0, None), np.tile(RED, (6, 8, 1))
    lab[:, ::2] = np.nan
    colours = compute_update(replace(field, colours=packed(lab)), scenes.params()).colours
    seen_ones = colours[~np.isnan(colours[:, 0])]
    assert len(seen_ones) > len(colours) / 2
    np.testing.assert_allclose(seen_ones, np.tile(RED, (len(seen_ones), 1)), atol=0.6)

    known, unknown = seen(0, RED), packed(np.full_like(lab, np.nan))
    after = scenes.mapped(known, replace(seen(1, None), colours=unknown)).store.colours
    np.testing.assert_array_equal(after, scenes.mapped(known).store.colours)


@pytest.mark.parametrize("stands", ["red", "blue"])
def test_the_colours_of_the_map_make_a_thing_probable(stands: str) -> None:
    belief = scenes.mapped(seen(0, RED if stands == "red" else BLUE))
    other = "blue" if stands == "red" else "red"
    told = answer(belief, stands)
    assert told.verdict.verdict is m.Verdict.NOT_LOOKED_YET
    evidence = f"probably {stands} by the map's colours: its picture was not looked at"
    assert [each.evidence for each in told.whereabouts[0].conditions] == [evidence]
    told = answer(belief, other)  # the one that is there, and why it is not the one
    assert told.verdict.verdict is not m.Verdict.FOUND
    (condition,) = told.whereabouts[0].conditions
    assert (told.scores[0] > 0.9, condition.evidence) == (True, f"not {other}")


def test_one_answer_is_the_one_that_fits() -> None:
    """A sofa whose colour is not known ranks above a red one."""
    field, lab = seen(0, None), np.full((6, 8, 3), np.nan, np.float32)
    features = np.tile(WALL, (6, 8, 1))
    features[2:4, 0:2] = features[2:4, 6:8] = SOFA
    lab[:, 5:] = RED * np.array([0.2, 0.8, 0.8], np.float32)  # so dark that it is hardly red
    field = replace(field, features=features.astype(np.float16), colours=packed(lab))
    scored = MapScores(scenes.mapped(field)).of([QUERY])
    for most, said in ((2, ["probably red", "perhaps not red"]), (1, ["probably red"])):
        request = m.SimilarityRequest("sofa", detail=m.Detail(colour="red"), max_regions=most)
        reply = similarity_reply(scored, request=request)
        evidence = [each.conditions[0].evidence for each in reply.whereabouts]
        assert all(map(str.startswith, evidence, said))
        assert len(reply.scores) == len(reply.centres_m) == most


def test_where_no_colour_is_known_none_is_found() -> None:
    told = answer(scenes.mapped(seen(0, None)), "blue")
    assert told.verdict.verdict is not m.Verdict.FOUND
    assert told.whereabouts[0].conditions[0].holds is m.Holds.NOT_CHECKED


def test_a_view_and_its_changes_tell_the_same_likeness() -> None:
    belief = scenes.mapped(seen(0, RED))
    replies, request = ViewReplies(MapScores(belief), "map"), m.ViewChangesRequest("sofa")
    plain = with_changes(None, replies.reply(request, [QUERY]))
    assert plain.whole().likeness.size == 0
    request = replace(request, colour="red", have=plain.key)
    view = with_changes(None, replies.reply(request, [QUERY]))
    belief.fuse(compute_update(seen(1, BLUE, 0.2), belief.params))
    view = with_changes(view, replies.reply(replace(request, have=view.key), [QUERY]))
    whole = search_view(MapScores(belief).of([QUERY]), text="sofa", colour="red")
    np.testing.assert_array_equal(view.whole().likeness, whole.likeness)


def test_colours_are_in_the_file_and_need_not_be(tmp_path: Path) -> None:
    belief, path = scenes.mapped(seen(0, RED)), tmp_path / "a.npz"
    snapshot = take(belief)
    for colours in (snapshot.colours, None):
        map_file.write(replace(snapshot, colours=colours), path)
        again = restore(map_file.read(path), belief.params, encoder_id="", first_revision=0)
        known = (
            belief.store.colours if colours is not None else np.full((again.store.count, 3), np.nan)
        )
        np.testing.assert_allclose(again.store.colours, known, atol=0.51)


def test_colours_weigh_as_the_views_that_told_them() -> None:
    """A cell that was seen long without a colour, then once in grey."""

    def store(confidence: float) -> CellStore:
        known = CellStore(1, device=CPU, dtype=torch.float32, max_prior=300.0)
        known.new_slots(np.zeros((1, 2), np.int64))
        for c, colour in ((confidence, None), (0.1, GREY)):
            see(known, c, colour)
        return known

    def see(known: CellStore, c: float, colour: F32 | None) -> None:
        beside = NOT_KNOWN if colour is None else NOT_KNOWN._replace(colours=colour[None])
        confidence = np.array([c], np.float32)
        known.fuse(FIRST, torch.zeros((1, 1)), confidence, revision=1, beside=beside)

    watched, fresh, merged = store(300.0), store(0.0), store(300.0)
    for _ in range(50):
        see(watched, 0.8, BLUE)
        see(fresh, 0.8, BLUE)
    np.testing.assert_array_equal(watched.colours, fresh.colours)
    np.testing.assert_allclose(watched.colours, BLUE[None], atol=1.0)
    none, one = np.zeros((1, LEVELS), np.float32), np.array([20.0])
    share = FeatureShare(watched.cells, torch.zeros((1, 1)), one, one, none, BLUE[None])
    merged.put_in(FIRST, share, revision=2)
    np.testing.assert_allclose(merged.colours, BLUE[None], atol=1.0)
    watched.put_in(FIRST, replace(share, colours=np.full((1, 3), np.nan, np.float32)), revision=2)
    np.testing.assert_array_equal(watched.colours, fresh.colours)


def test_colours_follow_a_merge() -> None:
    ours, theirs = scenes.mapped(seen(0, None)), scenes.mapped(seen(0, RED))
    merge_into(ours, take(theirs), PlanarMotion())
    np.testing.assert_allclose(ours.store.colours, theirs.store.colours, atol=0.51)
