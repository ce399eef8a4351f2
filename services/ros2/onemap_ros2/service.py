"""The ROS 2 adapter: a robot's topics to frames and odometry, velocity commands to its base."""

from __future__ import annotations

import logging
import time
from dataclasses import replace

from onemap_ros2.cdr import encode, header, known, new
from onemap_ros2.command_relay import CommandRelay
from onemap_ros2.config import Ros2Config
from onemap_ros2.network import NetworkError, RosNetwork, Writer, ZenohRosNetwork
from onemap_ros2.rmw_keys import SUBSCRIBER
from onemap_ros2.robot_input import CAMERA_INFO, IMAGE, ODOMETRY, TF, RobotInput
from onemap_ros2.topic_list import missing
from onemap_shared.command_gate import CommandGate
from onemap_shared.geometry import Velocity2d
from onemap_shared.keys import ROBOT_CMD_VEL, ROBOT_ODOMETRY, ROBOT_RGBD
from onemap_shared.messages import Odometry
from onemap_shared.runner import StartError
from onemap_shared.transport import Bus, Health

LOG = logging.getLogger("onemap.ros2")
STEP_S = 0.02  # longest wait for the robot's messages, and so the delay of a command
IMAGES_KEPT = 5
TRANSFORMS_KEPT = 100
# The topics by the names of their settings: type, messages kept.
INPUTS = {
    "tf_static": (TF, TRANSFORMS_KEPT),
    "tf": (TF, TRANSFORMS_KEPT),
    "camera_info": (CAMERA_INFO, 1),
    "odometry": (ODOMETRY, IMAGES_KEPT),
    "color": (IMAGE, IMAGES_KEPT),
    "depth": (IMAGE, IMAGES_KEPT),
}
TWIST, TWIST_STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"


class Ros2Worker:
    """One ROS 2 robot on OneMap's bus."""

    def __init__(self, bus: Bus, network: RosNetwork, config: Ros2Config) -> None:
        self._network = network
        self._config = config
        self._input = RobotInput(config)
        self._readers = {
            kind: network.read(
                getattr(config.topics, kind), ros_type, depth, latched=kind == "tf_static"
            )
            for kind, (ros_type, depth) in INPUTS.items()
        }
        self._frames = bus.publish(ROBOT_RGBD)
        self._odometry = bus.publish(ROBOT_ODOMETRY)
        self._commands = bus.subscribe(ROBOT_CMD_VEL)
        self._gate = CommandGate()
        self._relay = CommandRelay(config.stop_s)
        self._writer: tuple[str, Writer] | None = None
        self._last: tuple[float, int] | None = None  # odometry: when it was sent, its stamp

    def step(self, timeout_s: float) -> None:
        """Wait for messages, pass on what is complete, then drive or stop."""
        self._network.wait(min(timeout_s, STEP_S))
        now_s = time.monotonic()
        for kind, reader in self._readers.items():
            for data in reader.take():
                self._input.add(kind, data, now_s)
        while (odometry := self._input.take_odometry(now_s)) is not None:
            self._send(odometry, now_s)
        frame = self._input.take_frame(now_s)
        if frame is not None:
            self._frames.put(frame)
        self._drive(time.monotonic())

    def health(self) -> Health:
        """Ready while odometry arrives and there is a camera."""
        counts = self._input.counts
        problem = self._problem(time.monotonic())
        metrics: dict[str, float] = {
            "frames": counts.frames,
            "odometry": counts.odometry,
            "images_unpaired": self._input.unpaired,
            "no_transform": counts.no_transform,
            "unusable": counts.unusable,
            "clock_jumps": counts.clock_jumps,
            "late_commands": self._gate.late,
        }
        return Health(ready=not problem, problem=problem or self._input.problem, metrics=metrics)

    def close(self) -> None:
        """Stop the robot and leave its network."""
        if self._writer is not None and self._relay.driving:
            self._publish(Velocity2d())
        self._network.close()

    def _send(self, odometry: Odometry, now_s: float) -> None:
        self._last = (now_s, odometry.stamp_ns)
        planner, sequence = self._gate.echo(now_s)
        self._odometry.put(replace(odometry, planner=planner, command_sequence=sequence))

    def _drive(self, now_s: float) -> None:
        command = self._commands.take(0.0)
        if command is not None:
            self._gate, command = self._gate.receive(command, now_s, self._robot_ns(now_s))
        self._relay, velocity = self._relay.step(now_s, command, fresh=self._fresh(now_s))
        if velocity is not None and self._find_base():
            self._publish(velocity)

    def _fresh(self, now_s: float) -> bool:
        return self._last is not None and now_s - self._last[0] <= self._config.stale_s

    def _robot_ns(self, now_s: float) -> int:
        """The time now on the robot's clock, which may be simulated or differ from ours."""
        if self._last is None:
            return time.time_ns()
        return self._last[1] + int((now_s - self._last[0]) * 1e9)

    def _find_base(self) -> bool:
        """Whether the type of the command topic is known; the base's own subscriber says it."""
        if self._writer is not None:
            return True
        ros_type = command_type(self._network, self._config)
        if ros_type is None:
            return False
        self._writer = (ros_type, self._network.write(self._config.topics.command, ros_type))
        LOG.info("velocities go to %s as %s", self._config.topics.command, ros_type)
        return True

    def _publish(self, velocity: Velocity2d) -> None:
        if self._writer is None:
            return
        ros_type, writer = self._writer
        stamp_ns = self._robot_ns(time.monotonic())
        writer.put(twist(velocity, ros_type, stamp_ns, self._config.command_frame))

    def _problem(self, now_s: float) -> str:
        """What keeps the robot from being used; empty if nothing does."""
        topics = self._config.topics
        lacking = missing(self._network.endpoints(), topics)
        if not self._fresh(now_s):
            reason = self._input.problem or lacking.get("odometry", "no message arrives")
            return f"no odometry on {topics.odometry} for {self._config.stale_s:g} s: {reason}"
        if not self._input.has_camera:
            return lacking.get("camera_info", f"no camera information on {topics.camera_info}")
        if self._input.counts.frames == 0:
            lack = lacking.get("color") or lacking.get("depth")
            reason = self._input.problem or lack or "no color and depth images with near stamps"
            return f"no frame from {topics.color} and {topics.depth}: {reason}"
        if self._writer is None and self._config.command_type == "auto":
            return lacking.get("command", "")
        return ""


def command_type(network: RosNetwork, config: Ros2Config) -> str | None:
    """The type of the command topic as configured or as its subscriber says; None if neither."""
    if config.command_type != "auto":
        return TWIST if config.command_type == "Twist" else TWIST_STAMPED
    asked = {
        endpoint.ros_type
        for endpoint in network.endpoints()
        if endpoint.kind == SUBSCRIBER and endpoint.topic == config.topics.command
    }
    return next((each for each in (TWIST_STAMPED, TWIST) if each in asked and known(each)), None)


def twist(velocity: Velocity2d, ros_type: str, stamp_ns: int, frame: str) -> bytes:
    """A Twist or TwistStamped as bytes."""
    vector = "geometry_msgs/msg/Vector3"
    linear = new(vector, velocity.linear_mps, 0.0, 0.0)
    message = new(TWIST, linear, new(vector, 0.0, 0.0, velocity.angular_radps))
    if ros_type == TWIST_STAMPED:
        message = new(TWIST_STAMPED, header(stamp_ns, frame), message)
    return encode(message, ros_type)


def build(bus: Bus, config: Ros2Config) -> Ros2Worker:
    """Join the robot's network and make the worker, or raise StartError."""
    try:
        network = ZenohRosNetwork(config.connect, config.domain, config.node)
    except NetworkError as problem:
        raise StartError(str(problem), temporary=True) from problem
    return Ros2Worker(bus, network, config)


def check(config: Ros2Config) -> None:
    """Nothing that the configuration names can be looked at before the robot's network is."""
