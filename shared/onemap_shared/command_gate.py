"""Which velocity commands a robot follows: those of one planner, made on what it sent just now.

For every driver: the simulator, the robot of Habitat and ``examples/my_robot.py`` use it. Times
are seconds of any monotonic clock; stamps are those of the robot's own odometry, so that no two
clocks are compared.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import COMMAND_VALIDITY_MS, VelocityCommand

# As the planner's limit of the loop: the robot's own measure of the same, on its own clock. With
# 1.0 s, commands that are under way when a link slows down let it drive on, into a wall.
MAX_COMMAND_AGE_S = 0.6
# A planner that is silent for longer than a command is valid (0.3 s) and than it sends stops after
# a search (0.5 s) has let go of the robot.
RELEASE_S = 1.0
MAX_VALIDITY_S = COMMAND_VALIDITY_MS / 1e3  # of a command, whatever it says
STOP = Velocity2d()


@dataclass(frozen=True, slots=True)
class CommandGate:
    """The planner that the robot follows, and its newest command; for the next odometry.

    driver: the instance of the driver's own process, as its odometry names it: a command for
    another one was made before its start. planner: its instance; empty before the first command, or
    if it does not say. sequence: of its newest command, at least 0. heard_s: when that arrived.
    ends_s: when it runs out, and the robot brakes by itself; minus infinity after a stop. fresh:
    whether it was made on what the robot sent just now.
    late, foreign and disordered: counts of commands that were made on old odometry, came from
    another planner or for another driver, or were not newer than the newest.
    """

    driver: str = ""
    max_age_s: float = MAX_COMMAND_AGE_S
    planner: str = ""
    sequence: int = 0
    heard_s: float = float("-inf")
    ends_s: float = float("-inf")
    fresh: bool = False
    late: int = 0
    foreign: int = 0
    disordered: int = 0

    def receive(
        self, command: VelocityCommand, now_s: float, stamp_ns: int
    ) -> tuple[CommandGate, VelocityCommand | None]:
        """The gate after a command that arrived at ``now_s``, and what the robot does.

        None: the command counts for nothing. A late command becomes a stop: the planner does not
        see what happens now. So does one made on odometry of the future: the clock was set back;
        and one of before the robot began to brake by itself: the planner had not seen that.
        ``stamp_ns``: the time now, as odometry would be stamped with it.
        """
        if command.driver not in ("", self.driver):
            return replace(self, foreign=self.foreign + 1), None
        if self.holds(now_s):
            if command.planner != self.planner:
                return replace(self, foreign=self.foreign + 1), None
            if command.planner and command.sequence <= self.sequence:
                return replace(self, disordered=self.disordered + 1), None
        age_s = (stamp_ns - command.odometry_stamp_ns) * 1e-9
        fresh = 0.0 <= age_s <= self.max_age_s and not now_s - age_s < self.ends_s < now_s
        gate = replace(
            self,
            planner=command.planner,
            sequence=max(command.sequence, 0),
            heard_s=now_s,
            fresh=fresh or command.odometry_stamp_ns == 0,
        )
        if not command.moves:
            return replace(gate, ends_s=float("-inf")), command
        if gate.fresh:
            return replace(gate, ends_s=now_s + command.validity_ms * 1e-3), command
        stop = replace(command, linear_mps=0.0, angular_radps=0.0, lateral_mps=0.0)
        return replace(gate, late=self.late + 1), stop

    def echo(self, now_s: float) -> tuple[str, int]:
        """The planner that the robot follows now and its newest command, for odometry."""
        return (self.planner, self.sequence) if self.holds(now_s) else ("", 0)

    def holds(self, now_s: float) -> bool:
        """Whether the planner that the robot follows was heard within ``RELEASE_S``."""
        return now_s - self.heard_s <= RELEASE_S


@dataclass(frozen=True, slots=True)
class Deadman:
    """Deadman timer: the last command until it expires, afterwards a stop.

    Times are seconds of any monotonic clock.
    """

    timeout_s: float = MAX_VALIDITY_S
    command: Velocity2d = STOP
    expires_s: float = float("-inf")

    def with_command(self, command: Velocity2d, now_s: float, validity_s: float) -> Deadman:
        """The timer after a command that is valid for ``validity_s``, but at most ``timeout_s``."""
        return replace(self, command=command, expires_s=now_s + min(self.timeout_s, validity_s))

    def command_at(self, now_s: float) -> Velocity2d:
        """The command in force."""
        return self.command if self.holds(now_s) else STOP

    def holds(self, now_s: float) -> bool:
        """Whether the last command still counts."""
        return now_s < self.expires_s

    def expired_between(self, before_s: float, now_s: float) -> bool:
        """Whether a command other than a stop expired between two instants."""
        return self.command != STOP and before_s < self.expires_s <= now_s
