"""Whether a thing is on the table or under it, in a simulated room."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.merge import merge_into
from onemap_mapper.belief.submaps import PlanarCorrection
from onemap_mapper.query.regions import extent_band
from onemap_mapper.query.replies import similarity_reply
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery
from onemap_mapper.storage import snapshot
from onemap_shared.messages import SimilarityReply, SimilarityRequest
from tests.mapper import scenes, table_room
from tests.mapper.table_room import FEATURES, NAMES

# From which to which height the answer may reach, and which height it must hold, in metres.
LIES = {
    "table": (0.5, 0.9, 0.73),
    "cup": (0.7, 1.1, 0.85),
    "basket": (0.0, 0.5, 0.2),
    "rug": (0.0, 0.1, 0.0),
}


@pytest.fixture(scope="module")
def belief() -> BeliefMap:
    return table_room.seen_map()


def asked(belief: BeliefMap, name: str) -> SimilarityReply:
    """The best region of one of the things, which competes with all others."""
    index = NAMES.index(name)
    order = [index, *(k for k in range(len(NAMES)) if k != index)]
    query = TextQuery(name, torch.from_numpy(FEATURES[order]), 10.0)
    request = SimilarityRequest(name, max_regions=1)
    return similarity_reply(MapScores(belief).of([query]), request=request)


def assert_lies(name: str, band: np.ndarray) -> None:
    least, most, inside = LIES[name]
    low, high = band.tolist()
    assert least - 1e-6 <= low <= inside <= high <= most + 1e-6


@pytest.mark.parametrize("name", LIES)
def test_an_answer_says_where_in_height_the_match_lies(belief: BeliefMap, name: str) -> None:
    reply = asked(belief, name)
    middle = np.mean([(*box.low, *box.high) for box in table_room.THINGS[name]], axis=0)
    assert np.linalg.norm(reply.centres_m[0] - (middle[:2] + middle[3:5]) / 2) < 0.6
    assert_lies(name, reply.heights_m[0])


@pytest.mark.parametrize("name", ["cup", "basket"])
def test_an_object_lies_at_the_heights_of_its_extent(belief: BeliefMap, name: str) -> None:
    (box,) = table_room.THINGS[name]
    band = extent_band(belief.shared_version(), (*box.low[:2], *box.high[:2]))
    assert_lies(name, np.array(band))


def test_heights_follow_a_merge(belief: BeliefMap) -> None:
    merged = BeliefMap(scenes.params())
    turned = PlanarCorrection(np.pi / 2, 3.0, 1.0)
    merge_into(merged, snapshot.take(belief), turned)
    merge_into(merged, snapshot.take(belief), turned)
    for name in LIES:
        assert_lies(name, asked(merged, name).heights_m[0])
