"""Observations of the bus inside the process."""

from __future__ import annotations

import time

import numpy as np
import pytest

from onemap_shared import keys
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import (
    Heartbeat,
    MapRevision,
    Odometry,
    RgbdFrame,
    TextEmbeddings,
    TextRequest,
    VelocityCommand,
)
from onemap_shared.wire import Packet
from onemap_tools.doctor.observe import (
    BusObserver,
    depth_statistics,
    map_growth,
    observe,
    process_health,
)

HEIGHT_M = 1.0


def frame(depth_mm: np.ndarray, pitch_down_rad: float = 0.0) -> RgbdFrame:
    height, width = depth_mm.shape
    return RgbdFrame(
        sequence=1,
        stamp_ns=time.time_ns(),
        rgb=np.zeros((height, width, 3), np.uint8),
        depth_mm=depth_mm.astype(np.uint16),
        intrinsics=Intrinsics.from_fov(width, height, 1.2),
        T_map_camera=camera_mount(0.0, HEIGHT_M, pitch_down_rad),
    )


def beat(instance: str, progress: int, stamp_ns: int = 0) -> Heartbeat:
    return Heartbeat("mapper", instance, stamp_ns or time.time_ns(), progress, True)


def revision(frames: int, cells: int) -> MapRevision:
    return MapRevision(
        frames, frames, time.time_ns(), "mini-1", "minilm", frames, cells, 10, 20.0, 5.0
    )


def test_depth_statistics_are_of_the_returns() -> None:
    statistics = depth_statistics(frame(np.full((20, 30), 1000), pitch_down_rad=np.pi / 2))
    assert statistics.valid == 1.0
    assert statistics.median_m == pytest.approx(1.0)
    assert statistics.near == 0.0


def test_metres_sent_as_millimetres_are_near() -> None:
    assert depth_statistics(frame(np.full((20, 30), 3))).near == 1.0


def test_an_image_without_returns_has_no_median() -> None:
    statistics = depth_statistics(frame(np.zeros((20, 30))))
    assert statistics.valid == 0.0
    assert np.isnan(statistics.median_m)


def test_process_health_takes_the_newest_beat_and_the_largest_offset() -> None:
    process = process_health([(beat("a", 5), -0.4), (beat("a", 5), -0.01)])
    assert process.clock_offset_s == -0.01
    assert not process.advanced
    assert process_health([(beat("a", 5), 0.0), (beat("a", 6), 0.0)]).advanced
    assert process_health([(beat("a", 5), 0.0)]).advanced  # nothing to compare with


def test_map_growth_is_between_first_and_last_revision() -> None:
    growth = map_growth([revision(3, 100), revision(4, 90), revision(9, 140)])
    assert growth is not None
    assert (growth.frames, growth.cells) == ((3, 9), (100, 140))
    assert map_growth([]) is None


def test_every_topic_is_observed() -> None:
    router = MemoryRouter()
    robot, mapper = router.bus("simulator"), router.bus("mapper")
    observer = BusObserver(router.bus())

    def embed(request: TextRequest) -> TextEmbeddings:
        row = np.ones((1, 2), np.float32)
        mask = np.zeros((1, 0), np.uint8)
        return TextEmbeddings("mini-1", "minilm", request.texts, row, row[:0], mask, 1.0)

    router.bus().serve(keys.EMBED_TEXT, embed)
    robot.publish(keys.ROBOT_RGBD).put(frame(np.full((20, 30), 2000)))
    odometry = Odometry(1, time.time_ns(), pose_2d(0, 0, 0), 0.3, -0.1, True)
    robot.publish(keys.ROBOT_ODOMETRY).put(odometry)
    robot.publish(keys.ROBOT_CMD_VEL).put(VelocityCommand(1, 1, 0.1, -0.9))
    mapper.publish(keys.MAP_REVISION).put(revision(3, 100))
    for instance in ("a", "b"):
        mapper.publish(keys.heartbeat("mapper")).put(beat(instance, 1))
    router.inject(keys.ROBOT_RGBD.key, Packet(b"nonsense", b""))
    observer.poll()
    observed = observer.observations(1.0)

    assert observed.alive == {"simulator", "mapper"}
    assert observed.doubled == {}
    second = router.bus("simulator")
    assert set(observer.observations(1.0).doubled) == {"robot"}
    second.close()
    assert observed.depth is None  # only the newest frame is kept, and it cannot be decoded
    refused = {stream.name: stream.refused for stream in observed.streams}
    assert refused[keys.ROBOT_RGBD.key] == 1
    assert {process.instance for process in observed.processes} == {"a", "b"}
    assert (observed.motion.commanded, observed.motion.driven) == (0.9, 0.3)
    assert observed.motion.collided
    assert observed.text_encoder == ("mini-1", "minilm")
    assert observed.field_encoder is None


def test_no_perception_means_no_text_encoder() -> None:
    assert BusObserver(MemoryRouter().bus()).observations(0.0).text_encoder is None


def test_the_bus_is_observed_for_the_duration() -> None:
    router = MemoryRouter()
    mapper = router.bus("mapper")
    publisher = mapper.publish(keys.MAP_REVISION)
    publisher.put(revision(3, 100))
    began_s = time.monotonic()
    observed = observe(router.bus(), 0.05)
    assert time.monotonic() - began_s >= 0.05
    assert observed.duration_s == 0.05
    assert observed.map is not None
    assert observed.map.frames == (3, 3)
