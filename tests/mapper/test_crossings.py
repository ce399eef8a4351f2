"""What crosses between host and device: the frame, and what was asked for; no whole table.

The map is computed as on a GPU, without compiled code, on a device that only pretends to be one.
It is the same map as that of the compiled code on the host.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import torch

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.tiles import AREA
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
STATE = 4 + 1 + 1 + 1  # bytes of a cell of the tiles: slot, occupancy, assumed, floor seen
CONFIDENCES = 3 * 4  # bytes of an observed cell
COUNTS = 250  # bytes: sizes and bounds of what lies on the device, whatever the map's size
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
    slots, ones = scenes.slots_of(belief, cells), torch.ones(len(cells), device=DEVICE)
    belief.store.fuse(slots, features.to(DEVICE), ones, revision=belief.revision)
    crossed.clear()
    return belief


def assert_same(found: MapSnapshot, expected: MapSnapshot) -> None:
    for name in ("cells", "driving_cells", "evidence", "clear", "confidence", "explored"):
        got, wanted = getattr(found, name), getattr(expected, name)
        np.testing.assert_allclose(got, wanted, rtol=1e-5, atol=1e-9, err_msg=name)
    np.testing.assert_allclose(found.features, expected.features, atol=1e-5)
    np.testing.assert_allclose(found.known_heights(), expected.known_heights(), atol=1e-5)
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


def test_fusing_a_frame_moves_nothing_but_counts(crossed: Crossings) -> None:
    moved = []
    for side in (2, 120):
        belief, frame = map_of(side, crossed), update(1)
        crossed.clear()
        belief.fuse(frame)
        assert crossed.to_device == []
        moved.append((list(crossed.to_host), crossed.waits))
    small, large = moved
    assert small == large
    assert sum(large[0]) <= COUNTS


def test_a_frame_is_sent_once(crossed: Crossings) -> None:
    field = scenes.field(1, scenes.pose(-0.5, 0.0))
    found = compute_update(field, PARAMS)
    rows, columns = field.depth_mm.shape
    images = (field.features, field.depth_mm, field.variance)
    constants = 12 * (rows + columns) + COUNTS  # interpolation, distances of samples on rays
    assert sum(crossed.to_device) <= sum(image.nbytes for image in images) + constants
    assert sum(crossed.to_host) <= COUNTS
    assert len(found.cells) > COUNTS / 16
    assert len(found.occupancy.cells) > COUNTS / 16


def test_a_new_text_brings_back_its_scores_and_no_feature(
    crossed: Crossings, large: BeliefMap
) -> None:
    scores = MapScores(large)
    scores.of([text("sofa", 0)])
    crossed.clear()
    other = text("bed", 1)
    scored = scores.of([other])
    similarity_reply(scored, request=SimilarityRequest("bed"))
    state = STATE * large.tiles.count * AREA + CONFIDENCES * large.store.count
    scores_and_cosines = 8 * large.store.count
    regions = 100 * large.store.count  # of the cells of the answer: heights and views
    assert sum(crossed.to_host) <= state + scores_and_cosines + regions
    assert max(crossed.to_host) < FEATURES * large.store.count
