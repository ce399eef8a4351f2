"""Passes the planner's velocities on to the base."""

from __future__ import annotations

from dataclasses import dataclass, replace

from onemap_ros2.cdr import TWIST, TWIST_STAMPED, encode, header, known, new
from onemap_ros2.config import Ros2Config
from onemap_ros2.drive.driver import NEVER, GoalReport, Log, PlannerInputs, RobotNow
from onemap_ros2.network.interface import SUBSCRIBER, RosNetwork, Writer
from onemap_ros2.topic_list import missing
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import VelocityCommand


class Base:
    """The command topic: a publisher from when its type is known, which the base says."""

    def __init__(self, network: RosNetwork, config: Ros2Config) -> None:
        self._network, self._config = network, config
        self._writer: tuple[str, Writer] | None = None

    def find(self) -> str | None:
        """Announce the publisher early: its first message may be lost. The type, None before."""
        if self._writer is None:
            ros_type = command_type(self._network, self._config)
            if ros_type is None:
                return None
            topic = self._config.names.command
            self._writer = (ros_type, self._network.write(topic, ros_type))
        return self._writer[0]

    def publish(self, velocity: Velocity2d, robot: RobotNow) -> bool:
        """Send a velocity; whether there is a base."""
        if self._writer is None:
            return False
        ros_type, writer = self._writer
        writer.put(twist(velocity, ros_type, robot.stamp_ns, robot.frame))
        return True


class VelocityDriver:
    """Implements ``Driver``: velocities while they hold, then zero, then silence."""

    def __init__(self, network: RosNetwork, config: Ros2Config, log: Log) -> None:
        self._network, self._config, self._log = network, config, log
        self._relay, self._base = CommandRelay(), Base(network, config)
        self._found: str | None = None
        self._robot: RobotNow | None = None
        self._sent = 0

    def step(self, robot: RobotNow, command: VelocityCommand | None, inputs: PlannerInputs) -> None:
        """See ``Driver``; the planner's goals count for nothing here."""
        del inputs
        self._robot = robot
        found = self._base.find()
        if found != self._found:
            self._found = found
            self._log(f"velocities go to {self._config.names.command} as {found}")
        self._relay, velocity = self._relay.step(robot.now_s, command, fresh=robot.fresh)
        if velocity is not None:
            self._sent += self._base.publish(velocity, robot)

    def problem(self) -> str:
        """See ``Driver``."""
        if self._found is None:
            return missing(self._network.endpoints(), self._config).get("command", "")
        return ""

    def report(self) -> GoalReport:
        """See ``Driver``: there are no goals."""
        return GoalReport()

    @property
    def idle(self) -> bool:
        """See ``Driver``."""
        return not self._relay.driving

    def metrics(self) -> dict[str, float]:
        """See ``Driver``."""
        return {"velocities_sent": float(self._sent)}

    def close(self) -> None:
        """See ``Driver``."""
        if self._relay.driving and self._robot is not None:
            self._sent += self._base.publish(STOPPED, self._robot)


def command_type(network: RosNetwork, config: Ros2Config) -> str | None:
    """The type of the command topic as its subscriber says; None without one."""
    asked = {
        endpoint.ros_type
        for endpoint in network.endpoints()
        if endpoint.kind == SUBSCRIBER and endpoint.topic == config.names.command
    }
    return next((each for each in (TWIST_STAMPED, TWIST) if each in asked and known(each)), None)


def twist(velocity: Velocity2d, ros_type: str, stamp_ns: int, frame: str) -> bytes:
    """A Twist or TwistStamped as bytes."""
    vector = "geometry_msgs/msg/Vector3"
    linear = new(vector, velocity.linear_mps, velocity.lateral_mps, 0.0)
    message = new(TWIST, linear, new(vector, 0.0, 0.0, velocity.angular_radps))
    if ros_type == TWIST_STAMPED:
        message = new(TWIST_STAMPED, header(stamp_ns, frame), message)
    return encode(message, ros_type)


REPEAT_S = 0.1  # zero velocity at 10 Hz
ZEROS = 5  # more of them, before silence: a lost message must not leave the robot driving
STOPPED = Velocity2d()


@dataclass(frozen=True, slots=True)
class CommandRelay:
    """Decides what goes to ``cmd_vel``. Times are seconds of any monotonic clock.

    driving: whether the newest velocity that was sent is not yet followed by zeros. zeros: how many
    more are to be sent.
    """

    driving: bool = False
    valid_until_s: float = NEVER
    zeros: int = 0
    next_zero_s: float = NEVER

    def step(
        self, now_s: float, command: VelocityCommand | None, *, fresh: bool
    ) -> tuple[CommandRelay, Velocity2d | None]:
        """The relay after this moment, and the velocity to send now; None: nothing.

        ``fresh``: the robot's odometry is; commands that were made without it are not passed on.
        """
        if command is not None and fresh:
            until_s = now_s + command.validity_ms * 1e-3
            return CommandRelay(driving=True, valid_until_s=until_s), command.velocity
        if self.driving and (not fresh or now_s > self.valid_until_s):
            return CommandRelay(zeros=ZEROS, next_zero_s=now_s + REPEAT_S), STOPPED
        if not self.driving and self.zeros and self.next_zero_s <= now_s:
            return replace(self, zeros=self.zeros - 1, next_zero_s=now_s + REPEAT_S), STOPPED
        return self, None
