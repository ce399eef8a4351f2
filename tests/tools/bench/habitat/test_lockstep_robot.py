"""Habitat's robot in simulated time, over the bus."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_shared.geometry import Velocity2d
from onemap_tools.bench.habitat.lockstep_robot import LockstepHabitatRobot
from onemap_tools.bench.habitat.params import HabitatRobotParams
from tests.tools.bench.habitat.fake_world import FakeWorld


@pytest.fixture
def robot() -> LockstepHabitatRobot:
    return LockstepHabitatRobot(FakeWorld(), HabitatRobotParams(width=16, height=16))


def test_commands_move_it_and_odometry_says_where_it_is(robot: LockstepHabitatRobot) -> None:
    np.testing.assert_allclose(robot.odometry(), np.eye(4), atol=1e-12)
    for n in range(20):
        robot.advance(Velocity2d(0.5, 0.0), n / 20, (n + 1) / 20)
    assert robot.xy == pytest.approx((0.5, 0.0))
    assert (robot.collided, robot.contacts, robot.edges_crossed) == (False, 0, 0)
    robot.adapter.image = None
    frame = robot.frame(1.0)
    assert (frame.sequence, frame.stamp_ns) == (1, 2_000_000_000)
    assert robot.adapter.image is not None


def test_a_wall_is_a_contact(robot: LockstepHabitatRobot) -> None:
    for n in range(200):
        robot.advance(Velocity2d(0.7, 0.0), n / 20, (n + 1) / 20)
    assert robot.collided
    assert robot.contacts == 1


def test_a_message_that_is_none_is_a_fault_of_ours(
    robot: LockstepHabitatRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robot.adapter, "publish_frame", lambda stamp_ns: None)
    with pytest.raises(RuntimeError, match="no valid message"):
        robot.frame(0.0)
