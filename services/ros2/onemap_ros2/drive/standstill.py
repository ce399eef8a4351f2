"""Makes the base stand after a drive: what drives it on is not the planner's wish."""

from __future__ import annotations

from dataclasses import dataclass, replace

from onemap_ros2.drive.driver import NEVER

# Zeros after the robot last moved: it stands because of them, so one look says nothing.
HELD_S = 2.0
# Without zeros it must stand for as long again; then nobody but a person drives it.
RELEASE_S = 2.0
# Between two zeros: more than twice as often as nav2's controller sends, 20 Hz.
ZERO_PERIOD_S = 0.015


@dataclass(frozen=True, slots=True)
class StandstillWatch:
    """Times are seconds of a monotonic clock.

    on: whether the robot has to stand. moved_s: when it moved last, or was told to stand; zero_s:
    of the last zero.
    """

    on: bool = False
    moved_s: float = NEVER
    zero_s: float = NEVER

    def begun(self, now_s: float) -> StandstillWatch:
        """The robot has to stand from now on; zeros are sent at once."""
        return StandstillWatch(True, now_s)

    def armed(self, now_s: float) -> StandstillWatch:
        """The robot is expected to stand from now on; zeros are sent if it does not."""
        return StandstillWatch(True, now_s - HELD_S)

    def step(self, now_s: float, *, moving: bool, ended: bool) -> tuple[StandstillWatch, bool]:
        """The watch after this moment, and whether to send a zero now.

        moving: whether the robot moves, or may. ended: whether what drove it said that it ended;
        until then the watch has no end.
        """
        if not self.on:
            return self, False
        watch = replace(self, moved_s=now_s) if moving else self
        stood_s = now_s - watch.moved_s
        if ended and stood_s > HELD_S + RELEASE_S:
            return StandstillWatch(), False
        due = stood_s < HELD_S and now_s - watch.zero_s >= ZERO_PERIOD_S
        return (replace(watch, zero_s=now_s) if due else watch), due
