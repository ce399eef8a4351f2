"""The ROS 2 adapter: a robot's topics to frames and odometry, the planner's wishes to its base."""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, replace

from onemap_ros2.cdr import DIAGNOSTICS
from onemap_ros2.config import NODE, Ros2Config
from onemap_ros2.diagnostics import (
    Diagnosis,
    diagnostic_array,
    of_adapter,
    of_search,
    of_service,
    of_topic,
)
from onemap_ros2.display import Display
from onemap_ros2.drive.driver import Driver, GoalPose, Log, PlannerInputs, RobotNow, pose_of
from onemap_ros2.drive.nav2 import Nav2Driver
from onemap_ros2.drive.velocity import VelocityDriver
from onemap_ros2.frame_thread import FrameThread
from onemap_ros2.network.bridge import BridgeNetwork
from onemap_ros2.network.interface import PUBLISHER, NetworkError, RosNetwork
from onemap_ros2.network.rmw import RmwNetwork
from onemap_ros2.robot_input import RobotInput
from onemap_ros2.search_control import SearchControl
from onemap_ros2.topic_list import missing, needs
from onemap_ros2.topic_watch import SILENT_S, TopicWatch
from onemap_shared import keys
from onemap_shared.command_gate import CommandGate
from onemap_shared.messages import Heartbeat, Odometry, VelocityCommand
from onemap_shared.transport import Bus, Health

LOG = logging.getLogger("onemap.ros2")
STALE_S = 0.5  # without odometry, after which the robot is stopped: ten of the planner's 20 Hz
STANDS_MPS, STANDS_RADPS = 0.02, 0.05  # up to this a base that stands may report
STEP_S = 0.02  # longest wait for the robot's messages, and so the delay of a command
RETRY_S = 1.0  # between two attempts to join the robot's network
DIAGNOSTICS_PERIOD_S = 1.0  # as ROS 2's own nodes send them
DRIVEN_BY = ("command", "navigate")  # by setting, where the robot has such a node
LACK_PERIOD_S = 0.5  # between two looks for it: odometry comes 50 times a second
KEPT_BEATS = 20  # of all services, between two diagnostics
KEPT = {"tf_static": 100, "tf": 100, "odometry": 5, "color": 5, "depth": 5}  # between two steps
DRIVERS: dict[str, Callable[[RosNetwork, Ros2Config, Log], Driver]] = {
    "velocity": VelocityDriver,
    "nav2": Nav2Driver,
}


class Ros2Worker:
    """One ROS 2 robot on OneMap's bus."""

    def __init__(self, bus: Bus, network: RosNetwork, config: Ros2Config) -> None:
        self._network, self._clock = network, bus.clock
        self._config, self._topics = config, config.names
        self._input, self._making = RobotInput(config), FrameThread(bus.clock)
        self._readers = {
            kind: network.read(topic, types[0], KEPT.get(kind, 1), latched=kind == "tf_static")
            for kind, topic, types, role in needs(config)
            if role == PUBLISHER
        }
        began_s = self._clock.monotonic_s()
        self._watches = {
            kind: TopicWatch(kind, topic, began_s)
            for kind, topic, _, role in needs(config)
            if role == PUBLISHER and kind != "tf_static"  # which is sent once
        }
        self._last_frame_s = began_s
        self._frames = bus.publish(keys.ROBOT_RGBD)
        self._odometry = bus.publish(keys.ROBOT_ODOMETRY)
        self._commands = bus.subscribe(keys.ROBOT_CMD_VEL)
        self._gate = CommandGate(bus.instance)
        self._paths = bus.subscribe(keys.SEARCH_PATH)
        self._states = bus.subscribe(keys.SEARCH_STATE)
        self._revisions = bus.subscribe(keys.MAP_REVISION)
        self._planner_inputs = PlannerInputs()
        self._driver: Driver = DRIVERS[config.drive](network, config, LOG.info)
        self._control = SearchControl(bus, network, config)
        self._beats = bus.subscribe(keys.ALL_HEARTBEATS, KEPT_BEATS)
        self._services: dict[str, tuple[float, Heartbeat]] = {}  # when it came
        self._diagnostics = network.write(config.diagnostics, DIAGNOSTICS)
        self._next_diagnostics_s = self._next_lack_s = began_s
        self._lack = ""
        self._last: tuple[float, Odometry] | None = None  # when it was sent
        self._display: Display | None = None
        if config.display:
            self._display = Display(bus, network, config, self._now_ns)
            self._display.start()

    def step(self, timeout_s: float) -> None:
        """Wait for messages, pass on what is complete, then drive or stop."""
        self._network.wait(min(timeout_s, STEP_S))
        now_s = self._clock.monotonic_s()
        for kind, reader in self._readers.items():
            for data in reader.take():
                self._input.add(kind, data, now_s)
                if kind in self._watches:
                    self._watches[kind].add(data, now_s)
        while (odometry := self._input.take_odometry(now_s)) is not None:
            self._send(odometry, now_s)
        if (images := self._input.take_images(now_s)) is not None:
            self._making.offer(images)
        made = self._making.take()
        if made is not None and (frame := self._input.numbered(made)) is not None:
            self._frames.put(frame)
            self._last_frame_s = now_s
        self._drive(self._clock.monotonic_s())
        if now_s >= self._next_diagnostics_s:
            self._next_diagnostics_s = now_s + DIAGNOSTICS_PERIOD_S
            self._diagnose(now_s)

    def health(self) -> Health:
        """Ready while odometry arrives, there is a camera, and the robot can be driven."""
        problem = self._problem(self._clock.monotonic_s())
        metrics: dict[str, float] = {
            **asdict(self._input.counts),
            "images_unpaired": self._input.unpaired,
            "late_commands": self._gate.late,
            **self._driver.metrics(),
        }
        if self._display is not None:
            metrics["grids"] = self._display.grids
        return Health(ready=not problem, problem=problem or self._input.problem, metrics=metrics)

    def close(self) -> None:
        """Stop the robot, before anything that may wait; then leave its network."""
        with ExitStack() as later:  # in the opposite order, each whatever happens to the others
            later.callback(self._network.close)
            if self._display is not None:
                later.callback(self._display.close)
            later.callback(self._making.close)
            later.callback(self._control.close)
            later.callback(self._driver.close)

    def _send(self, odometry: Odometry, now_s: float) -> None:
        self._last = (now_s, odometry)
        planner, sequence = self._gate.echo(now_s)
        report = self._driver.report()
        reached, refused = _numbers(report.reached), _numbers(report.refused)
        known = replace(
            odometry, planner=planner, command_sequence=sequence, driver=self._gate.driver
        )
        hold = report.hold or self._undriven(now_s)
        self._odometry.put(replace(known, reached=reached, refused=refused, hold=hold))

    def _undriven(self, now_s: float) -> str:
        """Why nothing can drive the robot, as no node of it takes goals or velocities."""
        if now_s >= self._next_lack_s:
            self._next_lack_s = now_s + LACK_PERIOD_S
            lacking = missing(self._network.endpoints(), self._config)
            self._lack = next((lacking[each] for each in DRIVEN_BY if each in lacking), "")
        return self._lack

    def _drive(self, now_s: float) -> None:
        robot = RobotNow(
            now_s,
            self._robot_ns(now_s),
            self._fresh(now_s),
            pose_of(self._last[1].T_map_body) if self._last is not None else None,
            self._input.body_frame,
            self._moving(now_s),
        )
        self._driver.step(robot, self._command(robot), self._take_inputs(now_s))

    def _command(self, robot: RobotNow) -> VelocityCommand | None:
        """The planner's newest velocity, if it is one that the robot follows."""
        command = self._commands.take(0.0)
        if command is None:
            return None
        self._gate, command = self._gate.receive(command, robot.now_s, robot.stamp_ns)
        if command is not None:
            self._planner_inputs = self._planner_inputs.with_command(
                command, robot.now_s, fresh=self._gate.fresh
            )
        return command

    def _take_inputs(self, now_s: float) -> PlannerInputs:
        """What the planner says; the state of its search first."""
        status, path = self._states.take(0.0), self._paths.take(0.0)
        revision = self._revisions.take(0.0)
        if revision is not None:
            self._planner_inputs = self._planner_inputs.with_places(revision.places_version)
        if status is not None:
            self._planner_inputs = self._planner_inputs.with_status(status)
        self._control.step(status, stands=self._driver.idle and not self._moving(now_s))
        if path is not None:
            self._planner_inputs = self._planner_inputs.with_path(path, now_s)
        return self._planner_inputs

    def _fresh(self, now_s: float) -> bool:
        return self._last is not None and now_s - self._last[0] <= STALE_S

    def _moving(self, now_s: float) -> bool:
        """Whether the robot moves, by its odometry; without that it may."""
        if self._last is None or not self._fresh(now_s):
            return True
        moved = self._last[1]
        speed_mps = max(abs(moved.linear_mps), abs(moved.lateral_mps))
        return speed_mps > STANDS_MPS or abs(moved.angular_radps) > STANDS_RADPS

    def _now_ns(self) -> int:
        return self._robot_ns(self._clock.monotonic_s())

    def _robot_ns(self, now_s: float) -> int:
        """The time now on the robot's clock, which may be simulated or differ from ours."""
        if self._config.use_sim_time and self._input.clock_ns is not None:
            return self._input.clock_ns
        last = self._last
        if last is None:
            return self._clock.wall_ns()
        return last[1].stamp_ns + int((now_s - last[0]) * 1e9)

    def _diagnose(self, now_s: float) -> None:
        """Publish how the adapter, the robot's topics, OneMap's services and the search stand."""
        while (beat := self._beats.take(0.0)) is not None:
            self._services[beat.service] = now_s, beat
        if not self._diagnostics.has_subscribers:
            return
        services = sorted(self._services.items())
        parts: list[Diagnosis] = [
            of_adapter(self.health()),
            *(of_topic(watch, now_s) for watch in self._watches.values()),
            *(of_service(beat, now_s - at_s) for name, (at_s, beat) in services if name != "ros2"),
            of_search(self._control.status),
        ]
        self._diagnostics.put(diagnostic_array(parts, self._robot_ns(now_s)))

    def _problem(self, now_s: float) -> str:
        """What keeps the robot from being used; empty if nothing does."""
        if hold := self._driver.report().hold:
            return hold
        topics = self._topics
        lacking = missing(self._network.endpoints(), self._config)
        silent = "; ".join(filter(None, (w.silence(now_s) for w in self._watches.values())))
        if self._config.use_sim_time and self._input.clock_ns is None:
            return lacking.get("clock", f"no message arrives on {topics.clock}")
        if not self._fresh(now_s):
            reason = self._input.problem or lacking.get("odometry", "no message arrives")
            return f"no odometry on {topics.odometry} for {STALE_S:g} s: {_both(reason, silent)}"
        if not self._input.has_camera:
            reason = f"no camera information on {topics.camera_info}"
            return lacking.get("camera_info", reason)
        waited_s = now_s - self._last_frame_s
        if self._input.counts.frames == 0 or waited_s > SILENT_S:
            lack = lacking.get("color") or lacking.get("depth")
            reason = self._input.problem or lack or ""
            reason = _both(reason, silent) or "no color and depth images with near stamps"
            since = f" for {waited_s:.0f} s" if self._input.counts.frames else ""
            return f"no frame from {topics.color} and {topics.depth}{since}: {reason}"
        return self._undriven(now_s) or self._driver.problem()


def _numbers(goal: GoalPose | None) -> tuple[float, ...]:
    return () if goal is None else (goal.x_m, goal.y_m, goal.yaw_rad)


def _both(reason: str, silent: str) -> str:
    return "; ".join(filter(None, (reason, silent)))


def join(config: Ros2Config) -> RosNetwork:
    """The adapter's node on the robot's network; NetworkError without its router."""
    if config.middleware == "zenoh-bridge-ros2dds":
        return BridgeNetwork(config.connect)
    return RmwNetwork(config.connect, config.domain, NODE, config.namespace)


class JoiningWorker:
    """The adapter, which joins the robot's network when its router answers; until then it says so.

    A robot may be switched on hours later. ``join``: connects, or raises NetworkError.
    """

    def __init__(
        self, bus: Bus, config: Ros2Config, join: Callable[[Ros2Config], RosNetwork] = join
    ) -> None:
        self._bus, self._config, self._join = bus, config, join
        self._worker: Ros2Worker | None = None
        self._network: RosNetwork | None = None
        self._problem = f"waiting for a ROS 2 router at {', '.join(config.connect)}"
        self._joined, self._closed = bus.clock.event(), bus.clock.event()
        bus.clock.thread("join", self._run)

    def step(self, timeout_s: float) -> None:
        """See ``transport.Worker``: nothing to do before the robot's network is there."""
        if self._worker is None:
            if self._joined.wait(timeout_s) and self._network is not None:
                self._worker = Ros2Worker(self._bus, self._network, self._config)
        else:
            self._worker.step(timeout_s)

    def health(self) -> Health:
        """See ``transport.Worker``."""
        return self._worker.health() if self._worker else Health(False, self._problem)

    def close(self) -> None:
        """See ``transport.Worker``."""
        self._closed.set()
        if self._worker is not None:
            self._worker.close()
        elif self._network is not None:
            self._network.close()

    def _run(self) -> None:
        """Try until it succeeds; an attempt may take as long as the network lets it."""
        while not self._closed.is_set():
            try:
                self._network = self._join(self._config)
            except NetworkError as problem:
                if self._problem != str(problem):
                    LOG.warning("%s", problem)
                self._problem = str(problem)
                self._closed.wait(RETRY_S)
            else:
                self._joined.set()
                return


def build(bus: Bus, config: Ros2Config) -> JoiningWorker:
    """The adapter's worker on this bus."""
    return JoiningWorker(bus, config)
