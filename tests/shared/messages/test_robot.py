"""Frames, odometry and commands that no robot can mean are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from onemap_shared.messages import Odometry, RgbdFrame, VelocityCommand
from tests.shared.messages.broken import assert_refused

MIRRORED = np.diag([1.0, 1.0, -1.0, 1.0])


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"rgb": np.zeros((6, 8, 3), np.float32)}, "rgb has dtype float32"),
        ({"rgb": np.zeros((6, 8, 1), np.uint8)}, "rgb has shape"),
        ({"depth_mm": np.zeros((3, 4), np.uint16)}, "depth_mm has shape"),
        ({"T_map_camera": MIRRORED}, "T_map_camera.*reflection"),
        (
            {"rgb": np.zeros((0, 8, 3), np.uint8), "depth_mm": np.zeros((0, 8), np.uint16)},
            "no pixels",
        ),
    ],
)
def test_a_damaged_frame_is_refused(changes: dict[str, Any], reason: str) -> None:
    assert_refused(RgbdFrame, reason, **changes)


def test_a_mirrored_pose_is_refused() -> None:
    assert_refused(Odometry, "reflection", T_map_body=MIRRORED)


@pytest.mark.parametrize("field", ["linear_mps", "angular_radps"])
@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_velocity_that_is_not_finite_is_refused(field: str, value: float) -> None:
    assert_refused(VelocityCommand, "velocity is NaN or infinite", **{field: value})
