from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from onemap_shared.geometry import camera_mount, pose_2d
from onemap_shared.keys import ROBOT_ODOMETRY, ROBOT_RGBD
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import Odometry, RgbdFrame
from onemap_shared.runner import StartError
from onemap_simulator.replay.config import ReplayConfig
from onemap_simulator.replay.service import body_below, build, check

FAST = 60.0  # Hz


def play(config: ReplayConfig, steps: int) -> tuple[list[RgbdFrame], list[Odometry], float]:
    """Frames and odometry of a worker after so many steps, and its share of readable frames."""
    router = MemoryRouter()
    listener = router.bus()
    rgbd = listener.subscribe(ROBOT_RGBD, capacity=50)
    odometry = listener.subscribe(ROBOT_ODOMETRY, capacity=50)
    worker = build(router.bus("replay"), config)
    for _ in range(steps):
        worker.step(1.0 / FAST)
    health = worker.health()
    worker.close()
    seen = list(iter(lambda: rgbd.take(0.0), None))
    moved = list(iter(lambda: odometry.take(0.0), None))
    return seen, moved, (health.metrics or {})["frames_unreadable"]


def test_plays_in_a_loop_with_poses(directory: Path) -> None:
    seen, moved, _ = play(ReplayConfig(directory=directory, rate_hz=FAST), steps=20)
    assert len(seen) > 3
    assert [frame.sequence for frame in seen] == list(range(len(seen)))
    np.testing.assert_array_equal(seen[3].rgb, seen[0].rgb)
    assert [message.stamp_ns for message in moved] == [frame.stamp_ns for frame in seen]
    assert all(a.stamp_ns < b.stamp_ns for a, b in itertools.pairwise(seen))
    np.testing.assert_allclose(moved[1].T_map_body, pose_2d(1.0, 2.0, 0.5), atol=1e-9)


def test_without_loop_it_idles_after_the_last_frame(directory: Path) -> None:
    seen, _, _ = play(ReplayConfig(directory=directory, rate_hz=FAST, loop=False), steps=15)
    assert len(seen) == 3


def test_an_unreadable_frame_is_left_out_and_counted(directory: Path) -> None:
    (directory / "frame-000001.color.png").unlink()
    config = ReplayConfig(directory=directory, rate_hz=FAST, loop=False)
    seen, _, unreadable = play(config, steps=15)
    assert [frame.sequence for frame in seen] == [0, 2]
    assert unreadable == 1


def test_a_recording_that_cannot_be_read_does_not_start(tmp_path: Path) -> None:
    with pytest.raises(StartError, match="cannot read"):
        check(ReplayConfig(directory=tmp_path))
    with pytest.raises(StartError, match="cannot read"):
        build(MemoryRouter().bus("replay"), ReplayConfig(directory=tmp_path))


def test_the_body_stands_below_a_camera_that_looks_down() -> None:
    T = pose_2d(1.0, -2.0, 2.5) @ camera_mount(0.0, 1.2, 0.6)
    np.testing.assert_allclose(body_below(T), pose_2d(1.0, -2.0, 2.5), atol=1e-12)
