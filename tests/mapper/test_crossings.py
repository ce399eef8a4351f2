"""What crosses between host and device: the frame, and what was asked for; no whole table.

Features are multiplied and fused as on a GPU, on a device that only pretends to be one. It is the
same map as that of the compiled code.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import torch

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.blur import blur_kernel
from onemap_mapper.frame.projection import project
from onemap_mapper.frame.update import FrameUpdate, compute_update
from onemap_mapper.params import MapParams
from onemap_mapper.query.replies import similarity_reply
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery
from onemap_mapper.storage.snapshot import MapSnapshot, restore, take
from onemap_shared.geometry import I64
from onemap_shared.messages import FeatureField, SimilarityRequest
from tests.mapper import scenes
from tests.mapper.crossings import DEVICE, Crossings

PARAMS = scenes.params(compiled=False)
CHANNELS = 16
FEATURES = 4 * CHANNELS  # bytes of a cell's feature
ENTRY = 8 + 4  # bytes of a sparse matrix: column and value
ROW = 8 + 8 + 4  # bytes of a cell that is fused: index in the frame and in a block, gain
FINITE = 8  # bytes: whether all features are
PLACES = [(-0.5, 0.0, 0.0), (-0.4, 0.1, 0.4), (0.2, -0.3, 2.0), (0.2, -0.3, 2.0)]


@pytest.fixture
def crossed(monkeypatch: pytest.MonkeyPatch) -> Iterator[Crossings]:
    monkeypatch.setattr(MapParams, "torch_device", property(lambda _: DEVICE))
    with Crossings() as made:
        yield made


@pytest.fixture
def large(crossed: Crossings) -> BeliefMap:
    return map_of(120, crossed)


def fields() -> list[FeatureField]:
    return [scenes.field(k, scenes.pose(*place)) for k, place in enumerate(PLACES)]


def update(sequence: int) -> FrameUpdate:
    return compute_update(scenes.field(sequence, scenes.pose(-0.5, 0.0)), PARAMS)


def text(name: str, channel: int) -> TextQuery:
    concepts = torch.eye(CHANNELS, device=DEVICE)[torch.tensor([channel, 4, 5, 6], device=DEVICE)]
    return TextQuery(name, concepts, 20.0)


def map_of(side: int, crossed: Crossings) -> BeliefMap:
    """A frame, and a square field of other cells beside it."""
    belief = BeliefMap(PARAMS)
    belief.fuse(update(0))
    cells: I64 = np.argwhere(np.ones((side, side), bool)) + 200
    belief.grow(cells)
    features = torch.rand((len(cells), CHANNELS), generator=torch.Generator().manual_seed(1))
    belief.revision += 1
    slots, ones = scenes.slots_of(belief, cells), np.ones(len(cells), np.float32)
    belief.store.fuse(slots, features.to(DEVICE), ones, revision=belief.revision)
    crossed.clear()
    return belief


def assert_same(found: MapSnapshot, expected: MapSnapshot) -> None:
    for name in ("cells", "driving_cells", "evidence", "clear", "confidence", "explored"):
        got, wanted = getattr(found, name), getattr(expected, name)
        np.testing.assert_allclose(got, wanted, rtol=1e-5, atol=1e-9, err_msg=name)
    np.testing.assert_allclose(found.features, expected.features, atol=1e-5)
    np.testing.assert_allclose(found.heights, expected.heights, atol=1e-5)
    assert found.seen is not None
    assert expected.seen is not None
    for name in ("poses", "best", "last_seen_ns"):
        np.testing.assert_array_equal(getattr(found.seen, name), getattr(expected.seen, name))


def test_the_map_on_a_device_is_that_of_the_compiled_code(monkeypatch: pytest.MonkeyPatch) -> None:
    host = BeliefMap(scenes.params())
    for field in fields():
        host.fuse(compute_update(field, host.params))
    expected = take(host)
    monkeypatch.setattr(MapParams, "torch_device", property(lambda _: DEVICE))
    with Crossings():
        belief = BeliefMap(PARAMS)
        for field in fields():
            belief.fuse(compute_update(field, PARAMS))
        assert_same(take(belief), expected)
        again = restore(expected, PARAMS, encoder_id="", first_revision=1)
        assert_same(take(again), expected)


def test_fusing_a_frame_sends_its_rows_and_gains(crossed: Crossings) -> None:
    for side in (2, 120):
        belief, frame = map_of(side, crossed), update(1)
        crossed.clear()
        belief.fuse(frame)
        assert sum(crossed.to_device) == ROW * len(frame.cells)
        assert sum(crossed.to_host) == FINITE


def test_of_a_frame_patches_and_sparse_weights_are_sent(crossed: Crossings) -> None:
    field = scenes.field(1, scenes.pose(-0.5, 0.0))
    found = compute_update(field, PARAMS)
    h, w, _ = field.features.shape
    weights = project(
        np.divide(field.depth_mm, 1000, dtype=np.float32),
        field.variance,
        intrinsics=field.intrinsics,
        T_map_camera=field.T_map_camera,
        patch_shape=(h, w),
        params=PARAMS,
    )
    blur = blur_kernel(weights.cells, camera_xy_m=field.T_map_camera[:2, 3], params=PARAMS)
    rows = 8 * (len(weights.cells) + len(found.cells))
    entries = len(weights.rows.columns) + len(blur.rows.columns)
    assert sum(crossed.to_device) == field.features.nbytes + rows + ENTRY * entries
    assert crossed.to_host == []


def test_a_new_text_brings_back_its_scores_and_no_feature(
    crossed: Crossings, large: BeliefMap
) -> None:
    scores = MapScores(large)
    scores.of([text("sofa", 0)])
    crossed.clear()
    scored = scores.of([text("bed", 1)])
    similarity_reply(scored, request=SimilarityRequest("bed"))
    scores_and_cosines = 8 * large.store.count
    assert sum(crossed.to_host) <= scores_and_cosines + 100
    assert max(crossed.to_host) < FEATURES * large.store.count
