"""What counts as explored depends on where the camera was, not on how many frames it took."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.submaps import SubmapParams, SubmapStore
from onemap_mapper.belief.view_log import (
    KEYFRAME_DEG,
    KEYFRAME_M,
    MAX_VIEWS,
    views_since,
)
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_shared.messages import FeatureField, Layer
from tests.mapper import scenes

PARAMS = scenes.params(explored_variance=0.4)
SECONDS = 3.0


def drive(rate_hz: float, speed_mps: float, turn_radps: float) -> list[FeatureField]:
    """What a camera sees that drives through the room for ``SECONDS``."""
    times_s = np.arange(int(SECONDS * rate_hz) + 1) / rate_hz
    poses = [scenes.pose(speed_mps * t - 1.0, 0.0, turn_radps * t) for t in times_s]
    return [scenes.field(k, pose) for k, pose in enumerate(poses)]


def mapped(fields: list[FeatureField]) -> BeliefMap:
    belief = BeliefMap(PARAMS)
    for field in fields:
        belief.fuse(compute_update(field, PARAMS))
    return belief


def explored(belief: BeliefMap) -> set[tuple[int, int]]:
    bits = (belief.layers() & Layer.EXPLORED) > 0
    return {(int(x), int(y)) for x, y in np.argwhere(bits) + np.asarray(belief.grid.origin_cell)}


@pytest.mark.parametrize(("speed_mps", "turn_radps"), [(0.6, 0.0), (0.3, 0.3), (0.0, 0.8)])
def test_the_rate_hardly_changes_what_is_explored(speed_mps: float, turn_radps: float) -> None:
    slow, fast = (explored(mapped(drive(rate, speed_mps, turn_radps))) for rate in (2.0, 8.0))
    assert len(slow & fast) / len(slow | fast) > 0.85


def test_a_camera_that_stands_explores_nothing_new_but_its_features_improve() -> None:
    fields = drive(8.0, 0.0, 0.0)
    belief, once = mapped(fields), mapped(fields[:1])
    assert explored(belief) == explored(once)
    slots = scenes.slots_of(belief, once.store.cells)
    c = once.store.confidence
    summed = torch.isclose(belief.store.confidence[slots], len(fields) * c)
    assert summed.float().mean() > 0.98  # the others: at edges whose occupancy settles later
    torch.testing.assert_close(belief.store.explored_confidence[slots], c)
    torch.testing.assert_close(belief.store.searched_confidence[slots], c)


def test_a_new_search_counts_what_is_in_view_for_searched_only() -> None:
    belief = mapped(drive(2.0, 0.0, 0.0))
    before = belief.store.explored_confidence
    belief.reset_searched()
    assert not belief.store.searched_confidence.any()
    for k in (98, 99):
        belief.fuse(compute_update(scenes.field(k, scenes.pose(-1.0)), PARAMS))
    torch.testing.assert_close(belief.store.searched_confidence, before)
    torch.testing.assert_close(belief.store.explored_confidence, before)


def test_a_submap_counts_what_the_map_counts() -> None:
    """Else a map of which submaps were moved would differ from one that was seen there."""
    belief = BeliefMap(MapParams())
    submaps = SubmapStore(belief, SubmapParams(distance_m=0.3))
    for field in drive(8.0, 0.3, 0.0):
        update = compute_update(field, belief.params)
        belief.fuse(update)
        submaps.add(update)
    whole = belief.store.explored_confidence.double().sum()
    while submaps.count:
        submaps.close()
        taken = submaps._closed.pop().submap
        belief.take_out(taken.features)
    assert belief.store.explored_confidence.sum() < 1e-6 * whole


@given(st.floats(0, 3), st.floats(-3, 3))
def test_a_frame_counts_in_proportion_to_the_way_since_the_last(moved_m: float, yaw: float) -> None:
    start, there = scenes.pose(), scenes.pose(moved_m, 0.0, yaw)
    views = views_since(start, there)
    steps = max(moved_m / KEYFRAME_M, abs(np.degrees(yaw)) / KEYFRAME_DEG)
    if abs(steps - 1.0) > 1e-6:
        assert views == pytest.approx(min(steps / 2, MAX_VIEWS) if steps >= 1 else 0.0, abs=1e-6)
    assert views_since(None, there) == 1.0
