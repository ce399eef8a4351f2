"""The services in virtual time with an encoder and detectors of the hub, of random weights."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from onemap_perception.config import PerceptionConfig
from onemap_perception.service import components_of
from onemap_shared import keys
from onemap_shared.messages import SearchRequest, SearchViewRequest, SimilarityRequest
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.service import SimulatorWorker
from onemap_tools.bench.navigation.search import WatchedSearch
from onemap_tools.virtual.config import SystemConfig
from onemap_tools.virtual.system import Equipment, simulated
from tests.perception.tiny import (
    needs_open_clip,
    owl_folder,
    rtdetr_folder,
    tipsv2_folder,
)

pytestmark = [needs_open_clip, pytest.mark.slow]


def test_a_robot_maps_and_searches_with_them(tmp_path: Path) -> None:
    folder = str(tipsv2_folder(tmp_path / "tipsv2"))
    encoder = {"backend": "tipsv2", "model": folder, "long_side_px": 224}
    detector = {
        "backend": "routed",
        "coco_model": str(rtdetr_folder(tmp_path / "coco")),
        "model": str(owl_folder(tmp_path / "owl")),
    }
    camera = SimulatorConfig().camera.model_copy(update={"width": 160, "height": 120})
    config = SystemConfig(
        SimulatorConfig(seed=2, rgbd_hz=1.0, camera=camera),
        PerceptionConfig.model_validate({"encoder": encoder, "detector": detector}),
    )
    perception = components_of(config.perception)
    robot = simulated(generate_apartment(2), config.simulator)
    with closing(WatchedSearch(Equipment(config, robot, perception, tmp_path), 2)) as search:
        search.run(SearchRequest(("tv", "lamp")), 24.0)
        found = search.ask(keys.MAP_SIMILARITY, SimilarityRequest("lamp"))
        view = search.ask(keys.MAP_SEARCH_VIEW, SearchViewRequest("lamp"))
    scores = view.similarity[~np.isnan(view.similarity)]
    assert found.encoder_id == perception.encoder.encoder_id
    assert view.sequence >= 5
    assert 0 <= scores.min() < scores.max() <= 1
    assert search.driven_m(24.0) > 0.5
    assert isinstance(search.robot, SimulatorWorker)
    assert search.robot.parts.simulation.counts.collisions == 0
