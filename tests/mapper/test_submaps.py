"""Corrections of the pose: what a share put in and taken out leaves, and how submaps follow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.submaps import (
    PlanarCorrection,
    SubmapParams,
    SubmapStore,
    correction_at,
    moved_cells,
    occupancy_of,
)
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_mapper.session import PoseGraphFollower
from onemap_shared.geometry import F16, F64, I64, pose_2d
from onemap_shared.grid import GridSpec
from onemap_shared.messages import FeatureField, PoseGraph
from tests.mapper import scenes

FAINT = 1e-3  # confidence; one pixel at 2 m has 0.9
EACH_FRAME = SubmapParams(distance_m=0.01)  # of way per submap: each frame becomes one


def made(
    fields: Sequence[FeatureField],
    store: bool = True,
    params: MapParams | None = None,
    **changes: Any,
) -> tuple[BeliefMap, SubmapStore]:
    """A map of these fields with its submaps, or only the map."""
    belief = BeliefMap(params or MapParams())
    submaps = SubmapStore(belief, replace(EACH_FRAME, **changes))
    for field in fields:
        update = compute_update(field, belief.params)
        belief.fuse(update)
        if store:
            submaps.add(update)
    return belief, submaps


def graph(fields: Sequence[FeatureField], corrections: Sequence[F64]) -> PoseGraph:
    """A keyframe for each field, moved by these transforms of the map's frame."""
    published = np.stack([field.T_map_camera for field in fields])
    corrected = np.stack([D @ T for D, T in zip(corrections, published, strict=True)])
    stamps = np.array([field.stamp_ns for field in fields])
    return PoseGraph(1, int(stamps[-1]), stamps, published, corrected)


def follow(submaps: SubmapStore, message: PoseGraph) -> int:
    """Apply a graph to the end; returns how many submaps were moved."""
    submaps.follow(message)
    moved = 0
    while submaps.move_next():
        moved += 1
    return moved


def sorted_by_cell(cells: I64, *columns: np.ndarray) -> tuple[np.ndarray, ...]:
    order = np.lexsort(cells.T)
    return tuple(column[order] for column in (cells, *columns))


def assert_same(one: BeliefMap, two: BeliefMap) -> None:
    """The same cells with the same features, confidences and occupancy.

    Features of submaps are rounded to float16, at most 2**-11 of their length. Cells that only the
    tail of the blur reached, with a confidence below FAINT, may be lost to rounding.
    """
    features, occupancy = [], []
    for belief in (one, two):
        store = belief.store
        assert (store.confidence > 0).all()
        slots = belief.slots.values[belief.tiles.rows(store.cells)]
        np.testing.assert_array_equal(slots, np.arange(store.count))
        assert np.count_nonzero(belief.slots.values >= 0) == store.count
        F = store.features(np.arange(store.count)).numpy()
        F = np.hstack([F, store.heights(slice(0, store.count))])  # further channels of it
        all_c = (store.confidence, store.searched_confidence, store.explored_confidence)
        features.append(sorted_by_cell(store.cells, F, np.stack(all_c, axis=1)))
        share = occupancy_of(belief)
        state = belief.occupancy.states.values[belief.tiles.rows(share.cells)].numpy()
        occupancy.append(sorted_by_cell(share.cells, share.evidence, share.clear, state))
    for got, expected in zip(*occupancy, strict=True):
        np.testing.assert_array_equal(got, expected)
    keys = [cells @ np.array([1, 10**6]) for cells, _, _ in features]
    for key, (_, _, c), others in zip(keys, features, keys[::-1], strict=True):
        assert np.isin(key[c[:, 0] > FAINT], others).all()
    _, *index = np.intersect1d(keys[0], keys[1], return_indices=True)
    (F, c), (F_expected, c_expected) = (
        (one_F[at], one_c[at]) for (_, one_F, one_c), at in zip(features, index, strict=True)
    )
    np.testing.assert_allclose(c, c_expected, rtol=1e-3, atol=FAINT)
    clear = c_expected[:, 0] > 10 * FAINT
    np.testing.assert_allclose(F[clear], F_expected[clear], atol=2e-3)


def shown(seed: int, count: int = 4) -> list[FeatureField]:
    """Fields of random features from random poses in a room."""
    rng = np.random.default_rng(seed)
    poses = zip(rng.uniform(-1.5, 1.5, (count, 2)), rng.uniform(-3, 3, count), strict=True)
    return [scenes.field(k, scenes.pose(x, y, yaw)) for k, ((x, y), yaw) in enumerate(poses)]


def shifted(field: FeatureField, x_m: float, y_m: float) -> FeatureField:
    return replace(field, T_map_camera=pose_2d(x_m, y_m, 0.0) @ field.T_map_camera)


def random_corrections(seed: int, count: int) -> list[F64]:
    rng = np.random.default_rng((seed, 7))
    moves = rng.normal(0, (0.5, 0.5, 0.2), (count, 3)).tolist()
    return [pose_2d(x, y, yaw) for x, y, yaw in moves]


STAY = pose_2d(0.0, 0.0, 0.0)


@pytest.mark.parametrize("seed", range(2))
def test_moved_is_as_if_seen_from_the_corrected_pose(seed: int) -> None:
    """By whole cells, where moving needs no resampling."""
    fields = shown(seed)
    belief, submaps = made(fields)
    moves = [(0.0, 0.0), (0.7, -0.3), (0.0, 0.0), (-0.4, 1.2)]
    moved = follow(submaps, graph(fields, [pose_2d(x, y, 0.0) for x, y in moves]))
    assert moved == 2
    right = [shifted(field, x, y) for field, (x, y) in zip(fields, moves, strict=True)]
    expected, theirs = made(right)
    theirs.close()
    assert_same(belief, expected)


@given(st.integers(0, 1000))
@settings(max_examples=2, deadline=None)
def test_corrections_do_not_add_up(seed: int) -> None:
    fields = shown(seed)
    belief, submaps = made(fields)
    untouched, theirs = made(fields)
    theirs.close()
    assert follow(submaps, graph(fields, random_corrections(seed, 4))) == 4
    assert follow(submaps, graph(fields, random_corrections(seed + 1, 4))) == 4
    direct, others = made(fields)
    follow(others, graph(fields, random_corrections(seed + 1, 4)))
    assert_same(belief, direct)
    follow(submaps, graph(fields, [STAY] * 4))
    assert_same(belief, untouched)
    assert follow(submaps, graph(fields, [STAY] * 4)) == 0


def test_a_late_frame_is_moved_too() -> None:
    """Captured before the correction, computed after it."""
    # so far apart, also when corrected, that each counts as the most views
    early, late, after = (scenes.field(k, scenes.pose(0.7 * k)) for k in range(3))
    message = graph((early, late), [pose_2d(-0.5, 0.0, 0.0)] * 2)
    belief, submaps = made((early,), distance_m=5.0)
    assert follow(submaps, message) == 1
    for field in (late, after):
        update = compute_update(field, belief.params)
        belief.fuse(update)
        submaps.add(update)
    assert submaps.move_next()
    assert not submaps.move_next()
    submaps.close()
    expected, theirs = made(
        (shifted(early, -0.5, 0.0), shifted(late, -0.5, 0.0), after), distance_m=0.01
    )
    theirs.close()
    assert_same(belief, expected)


@pytest.mark.parametrize("limit", [{"count": 2}, {"memory_mb": 1}])
def test_beyond_the_limits_the_oldest_are_fixed(limit: dict[str, int]) -> None:
    wide = [np.random.default_rng(k).normal(size=(6, 8, 256)) for k in range(6)]
    fields = [replace(field, features=_unit(wide[k])) for k, field in enumerate(shown(2, 6))]
    belief, submaps = made(fields, **limit)  # type: ignore[arg-type]
    submaps.close()
    before, fixed = submaps.nbytes, submaps.fixed
    assert fixed >= 3
    assert before <= 10**6 or submaps.count == 2
    moves = [pose_2d(0.5, 0.0, 0.0)] * 6
    assert follow(submaps, graph(fields, moves)) == 6 - fixed
    right = fields[:fixed] + [shifted(field, 0.5, 0.0) for field in fields[fixed:]]
    expected, theirs = made(right)
    theirs.close()
    assert_same(belief, expected)


def test_what_the_map_held_before_stays() -> None:
    fields = shown(4)
    belief, _ = made(fields[:2], store=False)
    submaps = SubmapStore(belief, EACH_FRAME)
    for field in fields[2:]:
        update = compute_update(field, belief.params)
        belief.fuse(update)
        submaps.add(update)
    assert follow(submaps, graph(fields, [pose_2d(0.0, 0.6, 0.0)] * 4)) == 2
    expected, theirs = made(fields[:2], store=False)
    theirs = SubmapStore(expected, EACH_FRAME)
    for field in fields[2:]:
        update = compute_update(shifted(field, 0.0, 0.6), belief.params)
        expected.fuse(update)
        theirs.add(update)
    theirs.close()
    assert_same(belief, expected)


def test_a_reset_of_what_was_searched_holds_after_a_move() -> None:
    fields = shown(5)
    belief, submaps = made(fields[:3])
    belief.reset_searched()
    submaps.reset_searched()
    update = compute_update(fields[3], belief.params)
    belief.fuse(update)
    submaps.add(update)
    follow(submaps, graph(fields, [pose_2d(0.5, 0.0, 0.0)] * 4))
    alone, _ = made((shifted(fields[3], 0.5, 0.0),), store=False)
    searched = belief.store.searched_confidence.sum()
    torch.testing.assert_close(searched, alone.store.confidence.sum(), rtol=1e-3, atol=0)


def _unit(features: np.ndarray) -> F16:
    unit: F16 = (features / np.linalg.norm(features, axis=-1, keepdims=True)).astype(np.float16)
    return unit


POINTS = np.array([[0.0, 0.0], [1.5, -2.0], [-3.0, 4.0]])
SECOND = 10**9
START = 1_700_000_000 * SECOND


def keyframe_graph(*corrected: F64) -> PoseGraph:
    """Keyframes a second and a metre apart, with these poses now."""
    published = [pose_2d(float(k), 0.0, 0.3 * k) for k in range(len(corrected))]
    stamps = START + SECOND * np.arange(len(corrected))
    last = int(stamps[-1]) + SECOND
    return PoseGraph(1, last, stamps, np.stack(published), np.stack(corrected))


def test_undoing_a_correction_gives_the_points_back() -> None:
    correction = PlanarCorrection.about(POINTS[1], to_m=np.array([2.0, 0.5]), yaw_rad=0.7)
    np.testing.assert_allclose(correction.apply(POINTS[1:2]), [[2.0, 0.5]], atol=1e-12)
    np.testing.assert_allclose(correction.undo(correction.apply(POINTS)), POINTS, atol=1e-12)


def test_between_keyframes_the_correction_changes_evenly() -> None:
    message = keyframe_graph(pose_2d(0.0, 0.0, 0.0), pose_2d(1.0, 0.4, 0.5))
    centre_m = np.array([0.5, 0.0])
    half = correction_at(message, START + SECOND // 2, centre_m)
    first = correction_at(message, START, centre_m)
    second = correction_at(message, START + SECOND, centre_m)
    assert half.yaw_rad == pytest.approx(0.1)
    middle = (first.apply(centre_m[None]) + second.apply(centre_m[None])) / 2
    np.testing.assert_allclose(half.apply(centre_m[None]), middle)


SIZE_M = 0.1
SQUARE = np.argwhere(np.ones((20, 30), bool)) - (4, 11)
CENTRES = GridSpec(SIZE_M, (0, 0), (1, 1)).centres(SQUARE)


@pytest.mark.parametrize("yaw_rad", [-0.4, 0.02, 1.0, np.pi])
def test_a_turned_square_has_no_holes_and_no_doubles(yaw_rad: float) -> None:
    correction = PlanarCorrection(yaw_rad, 0.37, -1.21)
    cells, source = moved_cells(SQUARE, correction, SIZE_M)
    assert len(np.unique(cells, axis=0)) == len(cells)
    assert len(cells) == pytest.approx(len(SQUARE), rel=0.04)  # its area stays
    off_m = (cells + 0.5) * SIZE_M - correction.apply(CENTRES[source])
    assert np.linalg.norm(off_m, axis=1).max() <= SIZE_M / np.sqrt(2) + 1e-9
    filled = np.zeros(np.ptp(cells, axis=0) + 1, bool)
    filled[tuple((cells - cells.min(axis=0)).T)] = True
    for row in filled:
        inside = np.flatnonzero(row)
        assert row[inside[0] : inside[-1] + 1].all()  # a convex shape: each row is one run


FIELDS = [scenes.field(k, scenes.pose(0.2 * k)) for k in range(4)]
EMPTY = PoseGraph(0, 0, np.zeros(0, np.int64), np.zeros((0, 4, 4)), np.zeros((0, 4, 4)))


def following() -> PoseGraphFollower:
    return PoseGraphFollower(shared=False, params=SubmapParams(distance_m=0.1))


def moved_graph(fields: list[FeatureField], x_m: float = 0.5) -> PoseGraph:
    """Everything lies ``x_m`` further along x."""
    published = np.stack([field.T_map_camera for field in fields])
    stamps = np.array([field.stamp_ns for field in fields])
    return PoseGraph(1, int(stamps[-1]), stamps, published, pose_2d(x_m, 0.0, 0.0) @ published)


def fed(
    follower: PoseGraphFollower, belief: BeliefMap, fields: list[FeatureField]
) -> PoseGraphFollower:
    for field in fields:
        update = compute_update(field, belief.params)
        belief.fuse(update)
        follower.record(update)
    return follower


def finish(follower: PoseGraphFollower) -> int:
    """Work to the end; returns how many submaps were moved."""
    moved = 0
    while follower.busy:
        moved += follower.work()
    return moved


def test_without_a_graph_nothing_is_kept() -> None:
    follower = fed(following(), BeliefMap(MapParams()), FIELDS)
    follower.reset_searched()
    follower.replace(BeliefMap(MapParams()))
    assert not follower.busy
    assert follower.work() == 0
    assert follower.metrics() == {}


def test_moving_ends_with_the_slice(monkeypatch: pytest.MonkeyPatch) -> None:
    follower, belief = following(), BeliefMap(MapParams())
    follower.receive(EMPTY, belief)
    fed(follower, belief, FIELDS)
    now_s = iter(0.02 * k for k in range(100))
    monkeypatch.setattr("onemap_mapper.session.time.monotonic", lambda: next(now_s))
    follower.receive(moved_graph(FIELDS), belief)
    assert [follower.work(), follower.busy] == [2, True]
    assert [follower.work(), follower.busy] == [2, True]
    assert [follower.work(), follower.busy] == [0, False]


def test_a_correction_out_of_the_world_is_reported(caplog: pytest.LogCaptureFixture) -> None:
    follower, belief = following(), BeliefMap(MapParams())
    follower.receive(EMPTY, belief)
    fed(follower, belief, FIELDS[:1])
    follower.receive(moved_graph(FIELDS, x_m=5000.0), belief)
    assert follower.busy
    assert finish(follower) == 0
    assert "did the pose jump" in caplog.text
