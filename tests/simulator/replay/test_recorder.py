from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from onemap_simulator.replay.recorder import write_recording
from onemap_simulator.replay.recording import RecordedFrame, Recording
from tests.simulator.replay.recordings import INTRINSICS, frames


def test_what_was_written_is_read_again(directory: Path) -> None:
    recording = Recording.open(directory)
    assert len(recording) == 3
    assert recording.intrinsics == INTRINSICS
    for index, frame in enumerate(frames()):
        read = recording.frame(index)
        np.testing.assert_array_equal(read.rgb, frame.rgb)
        np.testing.assert_array_equal(read.depth_mm, frame.depth_mm)
        np.testing.assert_allclose(read.T_map_camera, frame.T_map_camera)


def test_the_recorder_refuses_to_mix(directory: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="not empty"):
        write_recording(directory, frames(), INTRINSICS)
    with pytest.raises(ValueError, match="at least one frame"):
        write_recording(tmp_path / "none", [], INTRINSICS)
    small = RecordedFrame(np.zeros((2, 2, 3), np.uint8), np.zeros((2, 2), np.uint16), np.eye(4))
    with pytest.raises(ValueError, match="frame 3 is 2 x 2"):
        write_recording(tmp_path / "mixed", [*frames(), small], INTRINSICS)
