"""A whole search in the grid world that nav2 drives, in simulated time: planner, adapter, nav2."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage

from onemap_planner.motion.motions import STOP, Pose2d
from onemap_planner.motion.velocity_controller import PathTracker, Plan
from onemap_planner.planning_thread import planned_path
from onemap_planner.policy.outcome import Decision
from onemap_planner.search.state_machine import EventStamp, status
from onemap_ros2.cdr import decode, type_hash
from onemap_ros2.config import Ros2Config
from onemap_ros2.drive.driver import GOAL_CHANGE_M, GoalPose, PlannerInputs, RobotNow
from onemap_ros2.drive.nav2 import Nav2Driver
from onemap_ros2.network.interface import Endpoint
from onemap_shared.command_gate import CommandGate
from onemap_shared.messages import VelocityCommand
from tests.planner.grid_world import CELL_M, STEP_S, SimulatedSearch
from tests.ros2.fake_network import FakeCall, FakeNetwork
from tests.ros2.stock_nav2 import EXECUTING, TOLERANCE_M, StockNav2

HEAD = bytes((0, 1, 0, 0))
KIND = "nav2_msgs/action/NavigateToPose_SendGoal"
SERVER = Endpoint("SS", "/nav2", "/navigate_to_pose/_action/send_goal", KIND, type_hash(KIND))


@dataclass
class Nav2Search(SimulatedSearch):
    """Steps the driver and nav2 between two plans.

    late: why the planner calls its inputs stale. said: what the adapter logs.
    """

    late: str = ""
    off_m: float = GOAL_CHANGE_M + TOLERANCE_M
    said: list[tuple[float, str]] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__post_init__()
        solid, grid = self.world.floor_plan.solid, self.world.floor_plan.grid
        clearance_m = ndimage.distance_transform_edt(~solid) * CELL_M - CELL_M / 2
        self.nav2 = StockNav2(grid, clearance_m, radius_m=0.25)
        self.network = FakeNetwork(SERVER)
        config = Ros2Config(drive="nav2")
        self.driver = Nav2Driver(
            self.network, config, lambda text: self.said.append((self.now_s, text))
        )
        self.inputs, self.gate = PlannerInputs(), CommandGate()
        self._spoken: Decision | None = None

    def _control(self) -> None:
        """The planner speaks, the adapter asks, nav2 drives."""
        now_s, params = self.now_s, self.config.drive
        self.world.wanted = STOP
        search = self.state.search
        message = status(search, EventStamp(now_s, 0.0, None, 0.0), now_ns=0)
        self.inputs = self.inputs.with_status(message)
        if self.decision is not None and self.decision is not self._spoken:
            self._spoken = self.decision
            path = planned_path(search, self.decision, 1)
            self.inputs = self.inputs.with_path(path, now_s)
        if self.decision is not None and not self.stale_reason and search.active:
            plan = Plan("", self.decision.motion, self.decision.costmap, now_s)
            tracker = PathTracker(params, STEP_S)
            self.world.wanted, _ = tracker.velocity(plan, self.world.pose, self.world.velocity)
        self._command()
        pose = self.world.pose
        here = GoalPose(pose.x_m, pose.y_m, pose.yaw_rad)
        self.driver.step(RobotNow(now_s, 7, True, here), None, self.inputs)
        self.problems.append(self.driver.problem())
        for call in sorted(self.network.calls, key=lambda call: call.service.endswith("result")):
            self._answer(call)
        self.network.calls = [call for call in self.network.calls if not call.done]
        report = self.driver.report()
        self.reached = None
        if report.reached is not None:
            self.reached = Pose2d(report.reached.x_m, report.reached.y_m, report.reached.yaw_rad)
        self.stale_reason = report.hold or self.late
        self.world.drive(self.nav2.step(pose), STEP_S)
        self.trace.append(self.world.pose.xy)
        self.now_s += STEP_S

    def _command(self) -> None:
        """The planner's velocity, through the gate, as in ``Ros2Worker``."""
        number, wanted = self.gate.sequence + 1, self.world.wanted
        stamp_ns = int((1 + self.now_s) * 1e9)
        command = VelocityCommand(
            number,
            stamp_ns,
            wanted.linear_mps,
            wanted.angular_radps,
            planner="p1",
            odometry_stamp_ns=stamp_ns,
            frame_ns=0 if self.decision is None or self.stale_reason else stamp_ns,
        )
        self.gate, obeyed = self.gate.receive(command, self.now_s, stamp_ns)
        assert obeyed is not None
        self.inputs = self.inputs.with_command(obeyed, self.now_s, fresh=self.gate.fresh)

    def _answer(self, call: FakeCall) -> None:
        goal_id = call.request[4:20]
        if call.service.endswith("send_goal"):
            wanted = decode(call.request, f"{KIND}_Request").goal.pose.pose
            yaw = 2 * float(np.arctan2(wanted.orientation.z, wanted.orientation.w))
            self.nav2.goal(goal_id, Pose2d(wanted.position.x, wanted.position.y, yaw))
            call.answer(HEAD + struct.pack("<?3xiI", True, 0, 0))
        elif call.service.endswith("get_result"):
            if self.nav2.states[goal_id] != EXECUTING:
                state = self.nav2.states[goal_id]
                call.answer(HEAD + struct.pack("<bxHIb", state, 0, 1, 0))
        else:
            call.answer(HEAD + struct.pack("<b3xI", self.nav2.cancel(goal_id), 0))
