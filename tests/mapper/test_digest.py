"""Two maps have the same digest if, and only if, they are equal bit for bit."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_mapper.storage.snapshot import ARRAYS, MapSnapshot, digest_of, sha256_of, take
from tests.mapper import scenes


def made(config: MapParams, frames: int = 3) -> BeliefMap:
    belief = BeliefMap(config)
    for k in range(frames):
        belief.fuse(compute_update(scenes.field(k, scenes.pose(-0.5, 0.2, 2.0 * k)), config))
    return belief


@pytest.fixture(scope="module")
def snapshot() -> MapSnapshot:
    return take(made(MapParams()))


def test_the_same_frames_give_the_same_digest(snapshot: MapSnapshot) -> None:
    assert sha256_of(snapshot) == sha256_of(take(made(MapParams())))
    assert sha256_of(snapshot) != sha256_of(take(made(MapParams(), frames=2)))


@pytest.mark.parametrize("name", ARRAYS)
def test_one_bit_changes_the_digest(snapshot: MapSnapshot, name: str) -> None:
    altered = getattr(snapshot, name).copy()
    altered.reshape(-1).view(np.uint8)[0] ^= 1
    assert sha256_of(dataclasses.replace(snapshot, **{name: altered})) != sha256_of(snapshot)


def test_the_settings_make_the_same_map_again() -> None:
    config = MapParams(cell_size_m=0.2)
    belief = made(config)
    digest = digest_of(take(belief), revision=belief.revision, params=config)
    assert (digest.revision, digest.frames_fused, digest.encoder_id) == (3, 3, "encoder-a")
    again = made(MapParams(**json.loads(digest.settings)))
    assert sha256_of(take(again)) == digest.sha256
    assert "torch" in digest.versions
