"""Following corrections beside the frames: nothing until asked, slices, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.submaps import SubmapParams
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_mapper.pose_graph_follower import PoseGraphFollower
from onemap_shared.geometry import pose_2d
from onemap_shared.messages import FeatureField, PoseGraph
from tests.mapper import scenes

FIELDS = [scenes.field(k, scenes.pose(0.2 * k)) for k in range(4)]
EMPTY = PoseGraph(0, 0, np.zeros(0, np.int64), np.zeros((0, 4, 4)), np.zeros((0, 4, 4)))


def following() -> PoseGraphFollower:
    return PoseGraphFollower(shared=False, params=SubmapParams(distance_m=0.1))


def graph(fields: list[FeatureField], x_m: float = 0.5) -> PoseGraph:
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


def test_an_empty_graph_announces_corrections() -> None:
    follower, belief = following(), BeliefMap(MapParams())
    follower.receive(EMPTY, belief)
    assert follower.work() == 0
    fed(follower, belief, FIELDS)
    assert follower.metrics()["submaps"] == 4
    assert follower.metrics()["submap_bytes"] > 0
    x_m = belief.store.cells[:, 0].mean() * 0.1
    follower.receive(graph(FIELDS), belief)
    assert finish(follower) == 4
    assert belief.store.cells[:, 0].mean() * 0.1 == pytest.approx(x_m + 0.5)


def test_moving_ends_with_the_slice(monkeypatch: pytest.MonkeyPatch) -> None:
    follower, belief = following(), BeliefMap(MapParams())
    follower.receive(EMPTY, belief)
    fed(follower, belief, FIELDS)
    now_s = iter(0.02 * k for k in range(100))
    monkeypatch.setattr("onemap_mapper.pose_graph_follower.time.monotonic", lambda: next(now_s))
    follower.receive(graph(FIELDS), belief)
    assert [follower.work(), follower.busy] == [2, True]
    assert [follower.work(), follower.busy] == [2, True]
    assert [follower.work(), follower.busy] == [0, False]


def test_another_map_has_other_submaps() -> None:
    follower, belief = following(), BeliefMap(MapParams())
    follower.receive(EMPTY, belief)
    fed(follower, belief, FIELDS)
    follower.replace(BeliefMap(MapParams()))
    follower.reset_searched()
    assert follower.metrics() == {"submaps": 0, "submaps_fixed": 0, "submap_bytes": 0}


def test_a_correction_out_of_the_world_is_reported(caplog: pytest.LogCaptureFixture) -> None:
    follower, belief = following(), BeliefMap(MapParams())
    follower.receive(EMPTY, belief)
    fed(follower, belief, FIELDS[:1])
    follower.receive(graph(FIELDS, x_m=5000.0), belief)
    assert follower.busy
    assert finish(follower) == 0
    assert "did the pose jump" in caplog.text
