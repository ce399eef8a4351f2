"""Recordings: read, refused, and played like a robot."""

from __future__ import annotations

import itertools
from pathlib import Path

import cv2
import numpy as np
import pytest

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_shared.keys import RGBD_RECEIPTS, ROBOT_ODOMETRY, ROBOT_RGBD
from onemap_shared.messages import FrameReceipt, Odometry, RgbdFrame
from onemap_simulator.replay.config import ReplayConfig
from onemap_simulator.replay.recording import RecordedFrame, RecordingError, read_recording
from onemap_simulator.replay.service import build
from tests.memory_bus import MemoryRouter
from tests.simulator.recordings import write_recording

INTRINSICS = Intrinsics(10.0, 10.0, 4.0, 3.0)


def frames(count: int = 3) -> list[RecordedFrame]:
    rng = np.random.default_rng(0)
    return [
        RecordedFrame(
            rng.integers(0, 256, (6, 8, 3), np.uint8),
            rng.integers(0, 9000, (6, 8), np.uint16),
            pose_2d(1.0, 2.0, 0.5 * k) @ camera_mount(0.0, 1.2, 0.3),
        )
        for k in range(count)
    ]


@pytest.fixture
def directory(tmp_path: Path) -> Path:
    return write_recording(tmp_path / "recording", frames(), INTRINSICS)


def test_depth_of_another_scale_becomes_millimetres(directory: Path) -> None:
    (directory / "camera.json").write_text('{"depth_scale_m": 0.01}')
    depth = read_recording(directory).frame(0).depth_mm
    tenfold = 10 * frames()[0].depth_mm.astype(int)
    np.testing.assert_array_equal(depth, np.where(tenfold <= 65535, tenfold, 0))


def test_a_folder_without_a_recording_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"holds no recording: it needs the folders pose and"):
        read_recording(tmp_path)


def test_bad_images_are_refused(directory: Path) -> None:
    recording = read_recording(directory)
    (directory / "color/0.png").unlink()
    with pytest.raises(RecordingError, match="does not exist"):
        recording.frame(0)
    (directory / "color/0.png").write_bytes(b"not a png")
    with pytest.raises(RecordingError, match="not an image"):
        recording.frame(0)
    cv2.imwrite(str(directory / "depth/1.png"), np.zeros((6, 8), np.uint8))
    with pytest.raises(RecordingError, match="is uint8 with 1 channels; depth must be uint16"):
        recording.frame(1)
    cv2.imwrite(str(directory / "depth/2.png"), np.zeros((3, 4), np.uint16))
    with pytest.raises(RecordingError, match=r"is 4 x 3, but the camera .* is 8 x 6"):
        recording.frame(2)


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


def test_an_unreadable_frame_is_left_out_and_counted(directory: Path) -> None:
    (directory / "color/1.png").write_bytes(b"not a png")
    config = ReplayConfig(directory=directory, rate_hz=FAST)
    seen, _, unreadable = play(config, steps=15)
    assert [frame.sequence for frame in seen][:3] == [0, 2, 3]
    assert unreadable >= 1


def test_frames_that_perception_did_not_take_are_counted_by_round(directory: Path) -> None:
    router = MemoryRouter()
    receipts = router.bus("perception").publish(RGBD_RECEIPTS)
    worker = build(router.bus("replay"), ReplayConfig(directory=directory, rate_hz=FAST))

    def played() -> float:
        return (worker.health().metrics or {})["frames_played"]

    def play_to(frames: int, *, taken: int) -> None:
        for sequence in range(taken):
            receipts.put(FrameReceipt(sequence, 1))
        while played() < frames:
            worker.step(1.0 / FAST)

    play_to(3, taken=0)
    assert "frames_lost" not in (worker.health().metrics or {})
    play_to(4, taken=2)
    assert "1 of 3 frames were lost" in worker.health().problem
    assert (worker.health().metrics or {})["frames_lost"] == 1
