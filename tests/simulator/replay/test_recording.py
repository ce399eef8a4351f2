from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from onemap_shared.camera import unproject
from onemap_shared.geometry import transform
from onemap_simulator.replay.recording import Recording, RecordingError
from tests.simulator.replay.recordings import frames

STUDY = Path(__file__).parents[3].parent / "shared" / "data" / "rgbd_study"


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


@pytest.mark.skipif(not STUDY.is_dir(), reason="the recording rgbd_study is not there")
def test_the_study_room_has_its_floor_at_zero() -> None:
    recording = Recording.open(STUDY)
    assert len(recording) == 5
    frame = recording.frame(0)
    depth_m = (frame.depth_mm / 1000).astype(np.float32)
    points = transform(
        frame.T_map_camera, unproject(depth_m, recording.intrinsics).astype(np.float64)
    )
    height = points[depth_m > 0][:, 2]
    low = height[np.abs(height) < 0.2]
    assert len(low) > 1000
    assert abs(np.median(low)) < 0.05
