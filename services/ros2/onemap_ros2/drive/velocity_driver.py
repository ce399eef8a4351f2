"""Passes the planner's velocities on to the base."""

from __future__ import annotations

from onemap_ros2.cdr import encode, header, known, new
from onemap_ros2.config import Ros2Config
from onemap_ros2.drive.command_relay import CommandRelay
from onemap_ros2.drive.driver import RobotNow
from onemap_ros2.drive.planner_voice import PlannerVoice
from onemap_ros2.network.endpoint import SUBSCRIBER
from onemap_ros2.network.interface import RosNetwork, Writer
from onemap_ros2.ros_types import TWIST, TWIST_STAMPED
from onemap_ros2.topic_list import missing
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import VelocityCommand


class VelocityDriver:
    """Implements ``Driver``: velocities while they hold, then zero, then silence."""

    def __init__(self, network: RosNetwork, config: Ros2Config) -> None:
        self._network, self._config = network, config
        self._topic = config.names.command
        self._relay = CommandRelay(config.stop_s)
        self._writer: tuple[str, Writer] | None = None
        self._stamp_ns = 0
        self._sent = 0
        self._news: list[str] = []

    def step(self, robot: RobotNow, command: VelocityCommand | None, voice: PlannerVoice) -> None:
        """See ``Driver``; the planner's goals count for nothing here."""
        del voice
        self._stamp_ns = robot.stamp_ns
        self._find_base()  # early: a publisher's first message may be lost
        self._relay, velocity = self._relay.step(robot.now_s, command, fresh=robot.fresh)
        if velocity is not None:
            self._publish(velocity)

    def problem(self) -> str:
        """See ``Driver``."""
        if self._writer is None and self._config.command_type == "auto":
            return missing(self._network.endpoints(), self._config).get("command", "")
        return ""

    def take_news(self) -> list[str]:
        """See ``Driver``."""
        news, self._news = self._news, []
        return news

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
            self._news.append(f"velocities go to {self._topic} as {ros_type}")

    def _publish(self, velocity: Velocity2d) -> None:
        if self._writer is None:
            return
        ros_type, writer = self._writer
        writer.put(twist(velocity, ros_type, self._stamp_ns, self._config.command_frame))
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
