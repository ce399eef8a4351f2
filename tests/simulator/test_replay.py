"""Recordings: written, read, refused, and played like a robot."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_shared.keys import RGBD_RECEIPTS, ROBOT_ODOMETRY, ROBOT_RGBD
from onemap_shared.messages import FrameReceipt, Odometry, RgbdFrame
from onemap_simulator.replay.config import ReplayConfig
from onemap_simulator.replay.recording import RecordedFrame, Recording, RecordingError
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
    write_recording(tmp_path / "recording", frames(), INTRINSICS)
    return tmp_path / "recording"


def test_what_was_written_is_read_again(directory: Path) -> None:
    recording = Recording.open(directory)
    assert len(recording) == 3
    assert recording.intrinsics == INTRINSICS
    for index, frame in enumerate(frames()):
        read = recording.frame(index)
        np.testing.assert_array_equal(read.rgb, frame.rgb)
        np.testing.assert_array_equal(read.depth_mm, frame.depth_mm)
        np.testing.assert_allclose(read.T_map_camera, frame.T_map_camera)


def test_depth_of_another_scale_becomes_millimetres(directory: Path) -> None:
    edit(directory, lambda index: index["camera"].update(depth_scale_m=0.01))
    depth = Recording.open(directory).frame(0).depth_mm
    tenfold = 10 * frames()[0].depth_mm.astype(int)
    np.testing.assert_array_equal(depth, np.where(tenfold <= 65535, tenfold, 0))


def edit(directory: Path, change: Callable[[Any], object]) -> None:
    path = directory / "frames.json"
    index = json.loads(path.read_text())
    change(index)
    path.write_text(json.dumps(index))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda index: index.pop("camera"), "lacks the entry 'camera'"),
        (lambda index: index["frames"].clear(), "no frames"),
        (lambda index: index["camera"].update(fx=-1), "focal lengths must be positive"),
        (lambda index: index["camera"].update(fx=[1]), "layout"),
        (lambda index: index["camera"].update(depth_scale_m=0), "must be positive"),
        (lambda index: index["frames"][1].pop("depth"), "lacks the entry 'depth'"),
        (lambda index: index["frames"][1].update(T_map_camera=[[1, 2], [3, 4]]), r"shape \(2, 2\)"),
        (
            lambda index: index["frames"][1].update(T_map_camera=(2 * np.eye(4)).tolist()),
            "frame 000001: T_map_camera is not rigid",
        ),
    ],
)
def test_a_bad_index_is_refused_in_a_sentence(
    directory: Path, change: Callable[[Any], object], reason: str
) -> None:
    edit(directory, change)
    with pytest.raises(RecordingError, match=reason):
        Recording.open(directory)


def test_a_missing_or_broken_index_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"cannot read .*frames\.json"):
        Recording.open(tmp_path)
    (tmp_path / "frames.json").write_text("{")
    with pytest.raises(RecordingError, match="not valid JSON"):
        Recording.open(tmp_path)
    (tmp_path / "frames.json").write_text("[]")
    with pytest.raises(RecordingError, match="layout"):
        Recording.open(tmp_path)


def test_bad_images_are_refused(directory: Path) -> None:
    recording = Recording.open(directory)
    (directory / "frame-000000.color.png").unlink()
    with pytest.raises(RecordingError, match="does not exist"):
        recording.frame(0)
    (directory / "frame-000000.color.png").write_bytes(b"not a png")
    with pytest.raises(RecordingError, match="not an image"):
        recording.frame(0)
    cv2.imwrite(str(directory / "frame-000001.depth.png"), np.zeros((6, 8), np.uint8))
    with pytest.raises(RecordingError, match="is uint8 with 1 channels; depth must be uint16"):
        recording.frame(1)
    cv2.imwrite(str(directory / "frame-000002.depth.png"), np.zeros((3, 4), np.uint16))
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
    (directory / "frame-000001.color.png").unlink()
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
