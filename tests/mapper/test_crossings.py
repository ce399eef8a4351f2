"""What crosses between host and device: the frame, and what was asked for; no whole table.

The map is computed as on a GPU, without compiled code, and what would cross is counted.
"""

from __future__ import annotations

import numpy as np
import pytest
import torch

from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame_update import FrameUpdate, compute_update
from onemap_mapper.map_scores import MapScores
from onemap_mapper.replies import search_view, similarity_reply
from onemap_mapper.similarity import TextQuery
from onemap_shared.geometry import I64
from onemap_shared.messages import SimilarityRequest
from tests.mapper import scenes
from tests.mapper.crossings import Crossings

PARAMS = scenes.params(compiled=False)
CHANNELS = 16
FEATURES = 4 * CHANNELS  # bytes of a cell's feature
TEXT, OTHER = (
    TextQuery(name, torch.eye(CHANNELS)[[k, 4, 5, 6]].contiguous(), 20.0)
    for k, name in enumerate(("sofa", "bed"))
)


def update(sequence: int) -> FrameUpdate:
    return compute_update(scenes.field(sequence, scenes.pose(-0.5, 0.0)), PARAMS)


def map_of(side: int) -> BeliefMap:
    """A frame, and a square field of other cells beside it."""
    belief = BeliefMap(PARAMS)
    belief.fuse(update(0))
    cells: I64 = np.argwhere(np.ones((side, side), bool)) + 200
    belief.grow(cells)
    features = torch.rand((len(cells), CHANNELS), generator=torch.Generator().manual_seed(1))
    belief.revision += 1
    slots = belief.slots_of(cells)
    belief.store.fuse(slots, features, torch.ones(len(cells)), revision=belief.revision)
    return belief


@pytest.fixture
def large() -> BeliefMap:
    return map_of(120)


def fused(belief: BeliefMap) -> Crossings:
    frame, crossed = update(1), Crossings()
    with crossed:
        belief.fuse(frame)
    return crossed


def test_fusing_a_frame_moves_no_more_into_a_large_map(large: BeliefMap) -> None:
    small = map_of(2)
    frame = update(1)
    few, many = fused(small), fused(large)
    assert few.bytes == many.bytes
    assert sum(many.to_host) == 8 * len(frame.cells)  # confidences, for the slots and the views
    assert sum(many.to_device) == 28 * len(frame.cells)  # index and place, gain and seed


def test_a_frame_is_sent_once(large: BeliefMap) -> None:
    field = scenes.field(1, scenes.pose(-0.5, 0.0))
    with Crossings() as crossed:
        cells = len(compute_update(field, PARAMS).cells)
    rows, columns = field.depth_mm.shape
    assert sum(crossed.to_device) <= 8 * field.depth_mm.size + 4 * field.features.size + 12 * (
        rows + columns
    )
    assert sum(crossed.to_host) <= 16 * cells


def test_the_state_of_the_map_moves_nothing(large: BeliefMap) -> None:
    scores = MapScores(large)
    with Crossings() as crossed:
        search_view(scores.of([]), text="")
    assert crossed.bytes == 0


def test_a_new_text_brings_back_its_scores_and_no_feature(large: BeliefMap) -> None:
    scores = MapScores(large)
    scores.of([TEXT])
    with Crossings() as crossed:
        scored = scores.of([OTHER])
        similarity_reply(scored, request=SimilarityRequest("bed"), params=MapperConfig())
    assert sum(crossed.to_host) <= 8 * large.store.count + 1000  # score and cosine
    assert sum(crossed.to_device) == 0
    assert max(crossed.to_host) < FEATURES * large.store.count


def test_a_text_that_is_asked_again_brings_back_what_changed(large: BeliefMap) -> None:
    scores = MapScores(large)
    scores.of([TEXT])
    assert len(frame := update(1).cells) < large.store.count / 10
    large.fuse(update(1))
    with Crossings() as crossed:
        scores.of([TEXT])
    assert sum(crossed.to_host) <= 8 * len(frame) + 1000
    assert sum(crossed.to_device) <= 40 * len(frame)


def test_whole_tables_would_be_counted(large: BeliefMap) -> None:
    with Crossings() as crossed:
        large.store.features(np.arange(large.store.count)).cpu()
    assert crossed.to_host == [FEATURES * large.store.count]
