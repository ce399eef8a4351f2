"""Small recordings for the tests of the replay."""

from __future__ import annotations

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_simulator.replay.recording import RecordedFrame

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
