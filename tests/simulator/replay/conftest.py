from __future__ import annotations

from pathlib import Path

import pytest

from onemap_simulator.replay.recorder import write_recording
from tests.simulator.replay.recordings import INTRINSICS, frames


@pytest.fixture
def directory(tmp_path: Path) -> Path:
    write_recording(tmp_path / "recording", frames(), INTRINSICS)
    return tmp_path / "recording"
