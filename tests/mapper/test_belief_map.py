"""The map: tiles against a dense map, what resets keep, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.belief.map import BeliefMap, FieldRejected
from onemap_mapper.belief.view_log import KEYFRAME_DEG, KEYFRAME_M, MAX_VIEWS, views_since
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_shared.messages import FeatureField, Layer, Occupancy
from tests.mapper import scenes
from tests.reference import mapping as slow

# Seen from several places, across the origin, so that tiles with negative indices take part.
POSES = tuple(scenes.pose(0.4 * k - 0.8, 0.2 * k, 1.1 * k) for k in range(5))


def mapped(fields: list[FeatureField], params: MapParams | None = None) -> BeliefMap:
    return scenes.mapped(*fields, params=params)


def fields() -> list[FeatureField]:
    return [scenes.field(k, T) for k, T in enumerate(POSES)]


def test_tiles_equal_a_dense_map() -> None:
    belief = mapped(fields())
    frames: list[slow.Cells] = []
    for field in fields():
        seen = compute_update(field, belief.params)
        rows = zip(seen.cells, seen.features.numpy(), seen.confidence, strict=True)
        frames.append({(int(x), int(y)): (F.astype(np.float64), float(c)) for (x, y), F, c in rows})
    dense = slow.fused(frames)
    assert belief.store.count == len(dense)
    features, confidence = slow.table(dense, belief.store.cells)
    everything = np.arange(belief.store.count)
    np.testing.assert_allclose(belief.store.features(everything), features, atol=1e-5)
    np.testing.assert_allclose(belief.store.confidence, confidence, rtol=1e-4)
    spread = belief.shared_version().to_grid(belief.store.confidence)
    place = belief.store.cells - np.array(belief.grid.origin_cell)
    np.testing.assert_array_equal(spread[tuple(place.T)], belief.store.confidence)
    assert np.isfinite(spread).sum() == len(dense)


@given(st.permutations(range(len(POSES))))
@settings(max_examples=5, deadline=None)
def test_the_order_of_frames_does_not_matter(order: list[int]) -> None:
    one, two = mapped(fields()), mapped([fields()[k] for k in order])
    slots = scenes.slots_of(two, one.store.cells)
    everything = np.arange(one.store.count)
    assert one.store.count == two.store.count
    torch.testing.assert_close(
        one.store.features(everything), two.store.features(slots), atol=1e-5, rtol=1e-3
    )
    np.testing.assert_allclose(one.store.confidence, two.store.confidence[slots], rtol=1e-5)


def test_a_new_search_forgets_only_where_was_looked() -> None:
    belief = mapped(fields() * 1)
    everything = np.arange(belief.store.count)
    features, confidence = belief.store.features(everything), belief.store.confidence
    assert (belief.shared_version().layers() & Layer.SEARCHED).any()
    explored = belief.shared_version().layers() & Layer.EXPLORED
    revision = belief.revision
    belief.reset_searched()
    assert belief.revision == revision + 1
    assert not (belief.shared_version().layers() & Layer.SEARCHED).any()
    np.testing.assert_array_equal(belief.shared_version().layers() & Layer.EXPLORED, explored)
    torch.testing.assert_close(belief.store.features(everything), features, atol=0, rtol=0)
    np.testing.assert_array_equal(belief.store.confidence, confidence)


def test_another_encoder_or_dimension_is_refused_and_nothing_changes() -> None:
    belief = mapped(fields()[:1])
    before = (belief.revision, belief.store.count, belief.frames_fused)
    other = scenes.field(1, POSES[1], encoder_id="encoder-b")
    wide = scenes.field(1, POSES[1], features=np.ones((2, 2, 5)))
    for field in (other, wide):
        with pytest.raises(FieldRejected, match="clear the map"):
            belief.fuse(compute_update(field, belief.params))
    assert (belief.revision, belief.store.count, belief.frames_fused) == before


def test_the_robots_own_place_is_free_at_first_sight_only(monkeypatch: pytest.MonkeyPatch) -> None:
    belief = mapped([scenes.field(k, scenes.pose(2.0 * k - 1)) for k in range(2)])
    cells = belief.grid.cells(np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    state = belief.shared_version().occupancy_grid()[tuple(cells.T)]
    assert state[0] == Occupancy.FREE
    monkeypatch.setattr("onemap_mapper.belief.map.INITIALLY_FREE_RADIUS_M", 0)
    without = mapped([fields()[0]])
    own = without.grid.cells(POSES[0][:3, 3])
    assert without.shared_version().occupancy_grid()[tuple(own)] == Occupancy.UNKNOWN


def test_assumed_floor_is_told_from_floor_that_was_seen() -> None:
    params = scenes.params()
    first = scenes.field(0, scenes.pose(-1.0))
    belief = mapped([first], params)
    own = tuple(belief.grid.cells(np.array([-1.0, 0.0])))
    before = (belief.shared_version().layers() & Layer.ASSUMED) > 0
    assert before[own]
    assert (belief.shared_version().occupancy_grid()[before] == Occupancy.FREE).all()
    seen = compute_update(first, params).occupancy
    cells = seen.cells[seen.clear] - np.array(belief.grid.origin_cell)
    assert not before[tuple(cells.T)].any()
    belief.fuse(compute_update(scenes.field(1, scenes.pose(-2.5)), params))
    own = tuple(belief.grid.cells(np.array([-1.0, 0.0])))
    assert not (belief.shared_version().layers() & Layer.ASSUMED)[own]  # seen from further back
    assert belief.shared_version().occupancy_grid()[own] == Occupancy.FREE


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
def test_cuda_makes_the_same_map() -> None:
    host, device = mapped(fields()), mapped(fields(), scenes.params(device="cuda"))
    everything = np.arange(host.store.count)
    order = scenes.slots_of(device, host.store.cells)
    assert host.store.count == device.store.count
    torch.testing.assert_close(
        device.store.features(order).cpu(), host.store.features(everything), atol=1e-4, rtol=1e-3
    )
    np.testing.assert_array_equal(host.shared_version().layers(), device.shared_version().layers())
    same = device.occupancy.evidence.values == host.occupancy.evidence.values
    assert same.all()


@pytest.mark.parametrize("name", ["features", "confidence"])
def test_values_that_are_not_finite_are_refused_and_nothing_changes(name: str) -> None:
    first, poisoned = (compute_update(field, scenes.params()) for field in fields()[:2])
    belief = mapped([])
    belief.fuse(first)
    getattr(poisoned, name)[0] = float("inf")
    with pytest.raises(FieldRejected, match="not finite"):
        belief.fuse(poisoned)
    assert belief.frames_fused == 1
    assert np.isfinite(belief.store.confidence).all()


PARAMS = scenes.params(explored_variance=0.4)
SECONDS = 3.0


def drive(rate_hz: float, speed_mps: float, turn_radps: float) -> list[FeatureField]:
    """What a camera sees that drives through the room for ``SECONDS``."""
    times_s = np.arange(int(SECONDS * rate_hz) + 1) / rate_hz
    poses = [scenes.pose(speed_mps * t - 1.0, 0.0, turn_radps * t) for t in times_s]
    return [scenes.field(k, pose) for k, pose in enumerate(poses)]


def driven(fields: list[FeatureField]) -> BeliefMap:
    return mapped(fields, PARAMS)


def explored(belief: BeliefMap) -> set[tuple[int, int]]:
    bits = (belief.shared_version().layers() & Layer.EXPLORED) > 0
    return {(int(x), int(y)) for x, y in np.argwhere(bits) + np.asarray(belief.grid.origin_cell)}


def test_a_camera_that_stands_explores_nothing_new_but_its_features_improve() -> None:
    fields = drive(8.0, 0.0, 0.0)
    belief, once = driven(fields), driven(fields[:1])
    assert explored(belief) == explored(once)
    slots = scenes.slots_of(belief, once.store.cells)
    c = once.store.confidence
    summed = np.isclose(belief.store.confidence[slots], len(fields) * c)
    assert summed.mean() > 0.98  # the others: at edges whose occupancy settles later
    np.testing.assert_allclose(belief.store.explored_confidence[slots], c, rtol=1e-6)
    np.testing.assert_allclose(belief.store.searched_confidence[slots], c, rtol=1e-6)


@given(st.floats(0, 3), st.floats(-3, 3))
def test_a_frame_counts_in_proportion_to_the_way_since_the_last(moved_m: float, yaw: float) -> None:
    start, there = scenes.pose(), scenes.pose(moved_m, 0.0, yaw)
    views = views_since(start, there)
    steps = max(moved_m / KEYFRAME_M, abs(np.degrees(yaw)) / KEYFRAME_DEG)
    if abs(steps - 1.0) > 1e-6:
        assert views == pytest.approx(min(steps / 2, MAX_VIEWS) if steps >= 1 else 0.0, abs=1e-6)
    assert views_since(None, there) == 1.0
