"""A robot, a planner's control loop and a delayed link between them, in simulated time.

The physics, the robot's check of commands, the planner's inputs, its velocity controller and its
collision monitor are the real ones; only the clock, the link and the plan are the test's. The plan
is wrong: it drives through the walls of a room that the map shows.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Generic, TypeVar

import numpy as np

from onemap_planner.inputs import LatestInputs, with_odometry, with_revision, with_sent
from onemap_planner.motion.motions import Drive
from onemap_planner.motion.staleness import LoopMonitor, SentCommand, StalenessParams
from onemap_planner.motion.velocity_controller import Plan, VelocityController
from onemap_planner.policy.params import PlannerParams
from onemap_planner.world.costmap import Costmap
from onemap_shared.command_gate import CommandGate
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import MapRevision, Odometry, VelocityCommand
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import RobotParams, RobotState
from onemap_simulator.physics.simulation import Simulation
from tests.planner.drawn_maps import CELL_M, PARAMS, costmap_of, drawn_map
from tests.simulator.scenes import WALL_SIDES, SceneBuilder

M = TypeVar("M")

TICK_S = 0.01
LONG_M, WIDE_M = 8.1, 4.1  # where the walls of the room begin on the map; the others end at a cell
PERIOD_S = 0.05  # of odometry and of commands
ROBOT_CLOCK_S = 1.7e9  # the robot's wall clock at the planner's time 0
TURN_S = 8.0  # after so long the plan drives through the other wall
START_XY = (4.1, 2.1)
DelayOf = Callable[[float], float]  # seconds each way, of the time


class Link(Generic[M]):
    """Delivers in order what is sent, each message ``delay_s(time of sending)`` later."""

    def __init__(self, delay_s: DelayOf) -> None:
        self._delay_s = delay_s
        self.under_way: deque[tuple[float, M]] = deque()

    def send(self, message: M, now_s: float) -> None:
        before_s = self.under_way[-1][0] if self.under_way else 0.0
        self.under_way.append((max(now_s + self._delay_s(now_s), before_s), message))

    def newest(self, now_s: float) -> M | None:
        """The newest message that arrived since the last call, as a ring of one keeps it."""
        message = None
        while self.under_way and self.under_way[0][0] <= now_s + 1e-9:
            message = self.under_way.popleft()[1]
        return message


@cache
def room() -> tuple[CollisionMap, Costmap]:
    """A room of 8 x 4 m, and the map of it."""
    builder = SceneBuilder()  # its walls lie within the occupied cells, as those of a map do
    builder.add("wall", (0.03, 0.03, 0), (8.17, 4.17, 2.5), sides=WALL_SIDES)
    rows = ("#" * 42, *["#" + "." * 40 + "#"] * 80, "#" * 42)
    costmap = costmap_of(drawn_map(*rows), START_XY, PARAMS.costmap)
    return CollisionMap.of(builder.build(), RobotParams().height_m), costmap


@dataclass
class Outcome:
    """What happened: times of commands that move, collisions, and metres driven."""

    moving_s: list[float] = field(default_factory=list)
    collisions: int = 0
    driven_m: float = 0.0
    reason: str = ""
    late: int = 0
    left_m: float = np.inf  # from the disc to a wall where it stands after a death of the planner


class DelayedRobot:
    """The robot's side: physics, its check of commands, its odometry."""

    def __init__(self, *, echoes: bool, checks: bool) -> None:
        self.physics = Simulation(room()[0], RobotParams(), RobotState(*START_XY, 0.0), now_s=0.0)
        self.gate = CommandGate() if checks else CommandGate(max_age_s=1e9)
        self._echoes, self._count = echoes, 0

    def step(self, command: VelocityCommand | None, now_s: float) -> None:
        self.physics.advance(now_s)
        if command is None:
            return
        self.gate, allowed = self.gate.receive(command, now_s, stamp_ns(now_s))
        if allowed is not None:
            velocity = Velocity2d(allowed.linear_mps, allowed.angular_radps)
            self.physics.receive_command(velocity, now_s, allowed.validity_ms / 1e3)

    def odometry(self, now_s: float) -> Odometry:
        self._count += 1
        state = self.physics.state
        v, w = state.velocity.linear_mps, state.velocity.angular_radps
        message = Odometry(self._count, stamp_ns(now_s), state.pose, v, w)
        planner, sequence = self.gate.echo(now_s)
        if self._echoes:
            message = replace(message, planner=planner, command_sequence=sequence)
        return message


class DelayedPlanner:
    """The planner's side: inputs, velocity controller and collision monitor, under one plan."""

    def __init__(self, staleness: StalenessParams) -> None:
        self.staleness = staleness
        self.inputs = LatestInputs(loop=LoopMonitor("p"))
        self.controller = VelocityController()
        self._sent = 0

    def step(self, odometry: Odometry | None, now_s: float) -> None:
        if odometry is None:
            return
        self.inputs = with_odometry(self.inputs, odometry, now_s)
        frames = odometry.sequence  # the map holds what the camera saw with this odometry
        revision = MapRevision(frames, 1, odometry.stamp_ns, "e", "s", frames, 1, 1, 1.0, 8.0)
        self.inputs = with_revision(self.inputs, revision, now_s)

    def command(self, now_s: float) -> VelocityCommand:
        far_x = 9.0 if int(now_s / TURN_S) % 2 == 0 else -1.0
        pose = self.inputs.pose
        start = pose.xy if pose else START_XY
        motion = Drive(np.array([start, (far_x, start[1])]), (far_x, start[1]))
        inputs = self.inputs.for_controller("s", now_s, self.staleness)
        plan = Plan("s", motion, room()[1], now_s, self.inputs.places_version)
        self.controller, _ = self.controller.update(
            plan, inputs, PARAMS.drive, max_plan_age_s=self.staleness.max_plan_age_s
        )
        self._sent += 1
        velocity = self.controller.command
        sent = SentCommand(self._sent, now_s, self.controller.velocity)
        self.inputs = with_sent(self.inputs, sent)
        odometry = self.inputs.odometry
        made_ns = odometry.stamp_ns if odometry else 0
        return VelocityCommand(
            self._sent,
            stamp_ns(now_s),
            velocity.linear_mps,
            velocity.angular_radps,
            validity_ms=round(1e3 * self.controller.validity_s),
            planner="p",
            odometry_stamp_ns=made_ns,
        )


def drive(
    delay_s: DelayOf,
    *,
    duration_s: float = 30.0,
    echoes: bool = True,
    checks: bool = True,
    staleness: StalenessParams | None = None,
    dies: bool = False,
) -> Outcome:
    """Drive to and fro between the walls over a link with this delay each way.

    dies: see after each command where the robot stands if it is the planner's last.
    """
    robot = DelayedRobot(echoes=echoes, checks=checks)
    planner = DelayedPlanner(staleness or PlannerParams().staleness)
    down: Link[VelocityCommand] = Link(delay_s)
    up: Link[Odometry] = Link(delay_s)
    outcome, before = Outcome(), robot.physics.state
    for tick in range(round(duration_s / TICK_S)):
        now_s = 1.0 + tick * TICK_S
        robot.step(down.newest(now_s), now_s)
        planner.step(up.newest(now_s), now_s)
        if tick % round(PERIOD_S / TICK_S) == 0:
            up.send(robot.odometry(now_s), now_s)
        if tick % round(PERIOD_S / TICK_S) == 2:
            command = planner.command(now_s)
            down.send(command, now_s)
            outcome.moving_s += [now_s] if command.moves else []
            if dies:
                outcome.left_m = min(outcome.left_m, left_alone_m(robot, down, now_s))
        state = robot.physics.state
        outcome.driven_m += float(np.hypot(state.x_m - before.x_m, state.y_m - before.y_m))
        before = state
    outcome.collisions = robot.physics.counts.collisions
    outcome.reason = planner.inputs.stale_reason(now_s, planner.staleness)
    outcome.late = robot.gate.late
    return outcome


def left_alone_m(robot: DelayedRobot, down: Link[VelocityCommand], now_s: float) -> float:
    """Metres from the robot's disc to the nearest wall on the map, once it stands.

    It still gets the commands that are under way, and no other.
    """
    robot, down = copy(robot), copy(down)
    robot.physics, down.under_way = copy(robot.physics), deque(down.under_way)
    while down.under_way or robot.physics.state.velocity != Velocity2d():
        now_s += TICK_S
        robot.step(down.newest(now_s), now_s)
    x_m, y_m = robot.physics.state.x_m, robot.physics.state.y_m
    to_walls_m = (x_m - CELL_M, LONG_M - x_m, y_m - CELL_M, WIDE_M - y_m)
    return min(to_walls_m) - RobotParams().radius_m


def stamp_ns(now_s: float) -> int:
    """A stamp of the robot's wall clock, which is not the planner's."""
    return int((ROBOT_CLOCK_S + now_s) * 1e9)
