"""Frames, odometry and commands that no robot can mean are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from onemap_shared.messages import (
    MAX_KEYFRAMES,
    Odometry,
    PoseGraph,
    RgbdFrame,
    VelocityCommand,
)
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


@pytest.mark.parametrize("field", ["linear_mps", "angular_radps", "lateral_mps"])
@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_velocity_that_is_not_finite_is_refused(field: str, value: float) -> None:
    assert_refused(VelocityCommand, "velocity is NaN or infinite", **{field: value})


def test_a_command_to_drive_sideways_moves() -> None:
    assert VelocityCommand(1, 2, 0.0, 0.0, lateral_mps=-0.1).moves
    assert not VelocityCommand(1, 2, 0.0, 0.0).moves


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"keyframe_stamps_ns": np.array([5, 5])}, "strictly ascending"),
        ({"keyframe_stamps_ns": np.array([5])}, "T_map_body_published has shape"),
        ({"T_map_body": np.stack([np.eye(4), MIRRORED])}, r"T_map_body\[1\].*reflection"),
        ({"keyframe_stamps_ns": np.arange(MAX_KEYFRAMES + 1)}, "1025 keyframes; the limit is 1024"),
    ],
)
def test_a_pose_graph_that_contradicts_itself_is_refused(
    changes: dict[str, Any], reason: str
) -> None:
    assert_refused(PoseGraph, reason, **changes)


def test_a_pose_graph_may_be_empty() -> None:
    none = np.zeros((0, 4, 4))
    assert len(PoseGraph(1, 2, np.zeros(0, np.int64), none, none).T_map_body) == 0
