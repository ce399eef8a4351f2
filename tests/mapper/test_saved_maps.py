"""Saved maps over the bus: merged into the map in use."""

from __future__ import annotations

from pathlib import Path

import pytest

from onemap_shared import keys
from onemap_shared.messages import MapFile, MapMerge
from onemap_shared.transport import RemoteError
from tests.mapper import scenes
from tests.mapper.test_service import Rig


def test_a_saved_map_is_merged_and_announced(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.feed(scenes.field(0, scenes.pose()))
    rig.mapper.save(MapFile("flat"))
    before = rig.mapper._map.store.confidence.numpy().copy()
    revision = rig.mapper._map.revision
    summary = rig.client.call(keys.MAP_MERGE, MapMerge("flat"))
    assert summary.cells_observed == len(before)
    assert summary.frames_fused == 2
    assert rig.mapper._map.revision > revision
    assert rig.mapper._map.store.confidence.numpy() == pytest.approx(2 * before)


def test_what_cannot_be_merged_is_refused(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    with pytest.raises(RemoteError, match="there is no map"):
        rig.client.call(keys.MAP_MERGE, MapMerge("nothing"))
    rig.feed(scenes.field(0, scenes.pose()))
    rig.mapper.save(MapFile("flat"))
    with pytest.raises(RemoteError, match="too large"):
        rig.client.call(keys.MAP_MERGE, MapMerge("flat", 9000.0))
