from __future__ import annotations

import numpy as np

from onemap_ros2.drive.velocity import CommandRelay
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import VelocityCommand

DRIVE = VelocityCommand(1, 1, 0.3, 0.1, validity_ms=300)


def sent(relay: CommandRelay, times_s: np.ndarray, *, fresh: bool = True) -> list[Velocity2d]:
    """What goes out at these times without a further command."""
    out = []
    for now_s in times_s:
        relay, velocity = relay.step(float(now_s), None, fresh=fresh)
        out += [velocity] if velocity is not None else []
    return out


def driving() -> CommandRelay:
    relay, velocity = CommandRelay(0.5).step(0.0, DRIVE, fresh=True)
    assert velocity == Velocity2d(0.3, 0.1)
    return relay


def test_a_command_holds_as_long_as_it_is_valid() -> None:
    assert sent(driving(), np.arange(0.0, 0.3, 0.02)) == []


def test_zero_is_repeated_and_then_there_is_silence() -> None:
    zeros = sent(driving(), np.arange(0.31, 5.0, 0.02))
    assert zeros == [Velocity2d()] * 6


def test_stale_odometry_stops_at_once_and_refuses_commands() -> None:
    relay, velocity = driving().step(0.05, DRIVE, fresh=False)
    assert velocity == Velocity2d()
    for now_s in np.arange(1.0, 2.0, 0.05):
        relay, velocity = relay.step(float(now_s), DRIVE, fresh=False)
        assert velocity in (Velocity2d(), None)


def test_without_any_command_nothing_is_ever_sent() -> None:
    """Another publisher of cmd_vel, such as a joystick, is not disturbed."""
    assert sent(CommandRelay(0.5), np.arange(0.0, 5.0, 0.05), fresh=False) == []
