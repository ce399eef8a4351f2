"""When the robot is sent a velocity: commands while they hold, then zero, then silence."""

from __future__ import annotations

from dataclasses import dataclass, replace

from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import VelocityCommand

REPEAT_S = 0.1  # zero velocity at 10 Hz
STOPPED = Velocity2d()


@dataclass(frozen=True, slots=True)
class CommandRelay:
    """Decides what goes to ``cmd_vel``. Times are seconds of any monotonic clock.

    Attributes:
        stop_s: for so long zero is sent before silence, so that one lost message is not enough to
            let the robot drive on. If this process is held up meanwhile, no zero is left out.
        driving: whether the newest velocity that was sent is not yet followed by zeros.
        valid_until_s: until then the newest command holds.
        zeros: how many more are to be sent.
        next_zero_s: when the next zero is due.
    """

    stop_s: float
    driving: bool = False
    valid_until_s: float = float("-inf")
    zeros: int = 0
    next_zero_s: float = float("-inf")

    def step(
        self, now_s: float, command: VelocityCommand | None, *, fresh: bool
    ) -> tuple[CommandRelay, Velocity2d | None]:
        """The relay after this moment, and the velocity to send now; None: nothing.

        ``fresh``: the robot's odometry is; commands that were made without it are not passed on.
        """
        if command is not None and fresh:
            until_s = now_s + command.validity_ms * 1e-3
            return replace(self, driving=True, valid_until_s=until_s), command.velocity
        if self.driving and (not fresh or now_s > self.valid_until_s):
            repeated = round(self.stop_s / REPEAT_S)
            stopping = replace(self, driving=False, zeros=repeated, next_zero_s=now_s + REPEAT_S)
            return stopping, STOPPED
        if not self.driving and self.zeros and self.next_zero_s <= now_s:
            return replace(self, zeros=self.zeros - 1, next_zero_s=now_s + REPEAT_S), STOPPED
        return self, None
