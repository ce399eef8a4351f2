"""Passes the planner's velocities on to the base."""

from __future__ import annotations

from dataclasses import dataclass, replace

from onemap_ros2.cdr import TWIST, TWIST_STAMPED, encode, header, known, new
from onemap_ros2.config import Ros2Config
from onemap_ros2.drive.driver import NEVER, PlannerVoice, RobotNow, Say
from onemap_ros2.network.interface import SUBSCRIBER, RosNetwork, Writer
from onemap_ros2.topic_list import missing
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import VelocityCommand


class VelocityDriver:
    """Implements ``Driver``: velocities while they hold, then zero, then silence."""

    def __init__(self, network: RosNetwork, config: Ros2Config, say: Say) -> None:
        self._network, self._config, self._say = network, config, say
        self._topic = config.names.command
        self._relay = CommandRelay()
        self._writer: tuple[str, Writer] | None = None
        self._robot: RobotNow | None = None
        self._sent = 0

    def step(self, robot: RobotNow, command: VelocityCommand | None, voice: PlannerVoice) -> None:
        """See ``Driver``; the planner's goals count for nothing here."""
        del voice
        self._robot = robot
        self._find_base()  # early: a publisher's first message may be lost
        self._relay, velocity = self._relay.step(robot.now_s, command, fresh=robot.fresh)
        if velocity is not None:
            self._publish(velocity)

    def problem(self) -> str:
        """See ``Driver``."""
        if self._writer is None and self._config.command_type == "auto":
            return missing(self._network.endpoints(), self._config).get("command", "")
        return ""

    def metrics(self) -> dict[str, float]:
        """See ``Driver``."""
        return {"velocities_sent": float(self._sent)}

    def close(self) -> None:
        """See ``Driver``."""
        if self._relay.driving:
            self._publish(Velocity2d())

    def _find_base(self) -> None:
        """Announce the publisher once the command topic's type is known; the base says it."""
        if self._writer is not None:
            return
        ros_type = command_type(self._network, self._config)
        if ros_type is not None:
            self._writer = (ros_type, self._network.write(self._topic, ros_type))
            self._say(f"velocities go to {self._topic} as {ros_type}")

    def _publish(self, velocity: Velocity2d) -> None:
        if self._writer is None or self._robot is None:
            return
        ros_type, writer = self._writer
        writer.put(twist(velocity, ros_type, self._robot.stamp_ns, self._robot.frame))
        self._sent += 1


def command_type(network: RosNetwork, config: Ros2Config) -> str | None:
    """The type of the command topic as configured or as its subscriber says; None if neither."""
    if config.command_type != "auto":
        return TWIST if config.command_type == "Twist" else TWIST_STAMPED
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
