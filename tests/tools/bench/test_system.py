"""A whole system's frames: ages by stage, and a robot's as real processes."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from onemap_perception.config import MiniParams
from onemap_perception.factory import make_encoder
from onemap_shared import keys
from onemap_shared.messages import FrameReceipt, TextRequest
from onemap_tools.bench.options import SystemBench
from onemap_tools.bench.recorded_robot import RecordedRobot, Stream
from onemap_tools.bench.system import ages_ms, lines, run
from tests.memory_bus import MemoryBus, MemoryRouter

TURN = np.broadcast_to(np.eye(4), (2, 4, 4))
STREAM = Stream(
    np.zeros((2, 18, 24, 3), np.uint8),
    np.ones((2, 18, 24), np.uint16),
    np.ones((2, 3, 4, 384), np.float16),
    np.ones((2, 18, 24), np.float32),
    TURN,
)


def test_ages_are_of_frames_in_the_window_that_both_stages_had() -> None:
    robot = RecordedRobot(MemoryBus(MemoryRouter()), STREAM, None)
    robot.ages["perception"] = {1: (10.0, 0.01), 2: (10.1, 0.02), 4: (10.3, 0.01)}
    robot.ages["mapper"] = {1: (10.04, 0.05), 2: (10.18, 0.1), 3: (10.2, 9.0), 4: (12.0, 1.7)}
    window = (9.0, 11.0)
    assert ages_ms([robot], "mapper", window, since="perception") == [60.0, 78.0]
    assert ages_ms([robot], "perception", (10.05, 10.2)) == [20.0, 20.0]
    assert ages_ms([robot], "command", window) is None


def test_a_recorded_robot_sends_fields_and_embeds_texts_for_their_map() -> None:
    encoder = make_encoder(MiniParams())
    router, stop = MemoryRouter(), threading.Event()
    robot, mapper = RecordedRobot(MemoryBus(router), STREAM, encoder), MemoryBus(router)
    fields = mapper.subscribe(keys.FIELD)
    threads = robot.start(100.0, 0.0, stop)
    try:
        field = fields.take(5.0)
        assert field is not None
        mapper.publish(keys.FIELD_RECEIPTS).put(FrameReceipt(field.sequence, field.stamp_ns))
        texts = mapper.call(keys.EMBED_TEXT, TextRequest(("sofa",)))
    finally:
        stop.set()
        for thread in threads:
            thread.join()
    assert (field.text_space, field.encoder_id) == (texts.text_space, encoder.encoder_id)
    assert field.stamp_ns in robot.ages["mapper"]


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_robot_is_followed_from_its_camera_to_its_commands() -> None:
    options = SystemBench(rate=5.0, seconds=3.0, size="160x120")
    result = run(options, lambda _: None)
    assert result["fused_hz"] > 0
    rows = {row["process"]: row for row in result["results"]}
    services = {"perception", "mapper", "planner", "gateway"}
    assert rows.keys() == {"router", *services, "robots"}
    assert rows["mapper"]["taken_ms"]
    assert rows["perception"]["stage_ms"]
    assert rows["perception"]["computing_ms"] > 0
    assert result["capture_to_map_ms"] == rows["planner"]["taken_ms"]
    assert result["capture_to_command_ms"]
    assert all(len(line) == len(lines(result)[0]) for line in lines(result)[1 : len(rows) + 1])
