"""The whole loop in simulated time with an encoder and detectors of the hub, of random weights."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import text_query
from onemap_perception.config import PerceptionConfig
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.apartment import generate_apartment
from onemap_tools.bench.lockstep import (
    LockstepSimulation,
    PerceptionPipeline,
    SimulatedRobot,
    SystemConfig,
)
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
    robot = SimulatedRobot(generate_apartment(2), config.simulator)
    perception = PerceptionPipeline(config.perception)
    simulation = LockstepSimulation(robot, config, perception)
    simulation.search(("tv", "lamp"), 20.0)
    belief = simulation.belief
    query = text_query(perception.encoder.embed_text(("lamp",)), 0, torch.device("cpu"))
    (scored,) = MapScores(belief).of([query]).texts
    assert belief.encoder_id == perception.encoder.encoder_id
    assert belief.frames_fused >= 10
    assert 0 <= scored.scores.min() < scored.scores.max() <= 1
    assert simulation.odometer_m > 0.5
    assert robot.simulation.counts.collisions == 0
