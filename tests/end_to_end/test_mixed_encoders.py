"""Two encoders never meet in one map: perception is swapped under a running mapper."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from onemap_mapper.config import MapperConfig
from onemap_mapper.service import build as build_mapper
from onemap_perception.config import PerceptionConfig
from onemap_perception.service import build as build_perception
from onemap_shared import keys
from onemap_shared.memory_bus import MemoryBus, MemoryHub
from onemap_shared.messages import RgbdFrame, SimilarityRequest
from onemap_shared.transport import RemoteError, Worker
from tests.mapper import scenes
from tests.perception.tiny import open_clip_folder, owl_folder
from tests.perception.toy import frame

pytest.importorskip("open_clip", reason="needs open_clip_torch (requirements-encoders.txt)")


def perception(hub: MemoryHub, clip: Path, owl: Path) -> tuple[Worker, MemoryBus]:
    """A running perception with this encoder, and its bus to close."""
    encoder = {"backend": "openclip_convnext", "model": str(clip), "warm_up_px": [64, 32]}
    detector = {"backend": "open_vocabulary", "model": str(owl)}
    config = PerceptionConfig.model_validate({"encoder": encoder, "detector": detector})
    bus = hub.bus("perception")
    return build_perception(bus, config), bus


def test_a_swapped_encoder_is_refused_by_the_map(tmp_path: Path) -> None:
    owl = owl_folder(tmp_path / "owl")
    first, second = (open_clip_folder(tmp_path / f"clip{seed}", seed) for seed in (0, 1))
    hub = MemoryHub()
    mapper = build_mapper(hub.bus("mapper"), MapperConfig(map_folder=tmp_path / "maps"))
    client = hub.bus("client")
    camera = client.publish(keys.ROBOT_RGBD)

    def see(worker: Worker, picture: RgbdFrame) -> float:
        camera.put(replace(picture, T_map_camera=scenes.pose()))
        worker.step(0.0)
        mapper.step(0.0)
        return (mapper.health().metrics or {})["frames_fused"]

    worker, bus = perception(hub, first, owl)
    assert see(worker, frame(1)) == 1
    assert client.call(keys.MAP_SIMILARITY, SimilarityRequest("lamp")).encoder_id
    bus.close()
    worker, _ = perception(hub, second, owl)
    assert see(worker, frame(2)) == 1  # not fused
    assert "openclip_convnext-" in mapper.health().problem
    with pytest.raises(RemoteError) as refusal:
        client.call(keys.MAP_SIMILARITY, SimilarityRequest("sofa"))
    assert refusal.value.code == "encoder_mismatch"
