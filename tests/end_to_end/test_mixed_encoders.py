"""One map never mixes encoders: perception is replaced beside a running mapper, over Zenoh."""

from __future__ import annotations

from dataclasses import replace
from itertools import count
from pathlib import Path

import pytest

from onemap_mapper.config import MapperConfig
from onemap_mapper.service import build as build_mapper
from onemap_perception.config import PerceptionConfig
from onemap_perception.service import build as build_perception
from onemap_shared import keys
from onemap_shared.messages import SimilarityRequest
from onemap_shared.transport import Bus, RemoteError, Worker
from tests.mapper import scenes
from tests.perception.tiny import needs_open_clip, open_clip_folder, owl_folder
from tests.perception.toy import frame
from tests.shared.test_bus import Router, eventually, join, router

__all__ = ["router"]  # the fixture
pytestmark = needs_open_clip


class Pipeline:
    """Perception, mapper and a camera as sessions of one Zenoh router."""

    def __init__(self, router: Router, folder: Path) -> None:
        self._router = router
        self._owl = owl_folder(folder / "owl")
        self.client = join(router, "client")
        self.camera = self.client.publish(keys.ROBOT_RGBD)
        config = MapperConfig(map_folder=folder / "maps")
        self.mapper = build_mapper(join(router, "mapper"), config)
        self._shown = count(1)

    def perception(self, clip: Path) -> tuple[Worker, Bus]:
        """A running perception with this encoder, and its bus to close."""
        encoder = {"backend": "openclip_convnext", "model": str(clip)}
        detector = {"backend": "open_vocabulary", "model": str(self._owl)}
        config = PerceptionConfig.model_validate({"encoder": encoder, "detector": detector})
        bus = join(self._router, "perception")
        return build_perception(bus, config), bus

    def show(self, worker: Worker) -> None:
        """Publish one image and let both services process it."""
        image = replace(frame(next(self._shown)), T_map_camera=scenes.pose())
        self.camera.put(image)
        worker.step(0.02)
        self.mapper.step(0.02)

    def fused(self) -> float:
        return (self.mapper.health().metrics or {})["frames_fused"]


def test_a_swapped_encoder_is_refused_by_the_map(router: Router, tmp_path: Path) -> None:
    first, second = (open_clip_folder(tmp_path / f"clip{seed}", seed) for seed in (0, 1))
    pipeline = Pipeline(router, tmp_path)
    worker, bus = pipeline.perception(first)

    def map_of_the_first() -> bool | None:
        pipeline.show(worker)
        return pipeline.fused() > 0 or None

    assert eventually(map_of_the_first)
    assert pipeline.client.call(keys.MAP_SIMILARITY, SimilarityRequest("lamp")).encoder_id
    bus.close()
    fused = pipeline.fused()
    worker, _ = pipeline.perception(second)

    def problem() -> str | None:
        pipeline.show(worker)
        return pipeline.mapper.health().problem or None

    assert "openclip_convnext-" in eventually(problem)
    assert pipeline.fused() == fused
    with pytest.raises(RemoteError) as refusal:
        pipeline.client.call(keys.MAP_SIMILARITY, SimilarityRequest("sofa"))
    assert refusal.value.code == "encoder_mismatch"
