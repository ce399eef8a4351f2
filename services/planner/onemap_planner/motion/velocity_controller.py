"""20 Hz velocity controller: tracks the last plan, stops before obstacles and on stale inputs."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from onemap_planner.motion.collision_monitor import (
    USUAL_DELIVERY_S,
    VALIDITIES_S,
    CheckedCommand,
    ControlTimes,
    MonitorCounts,
    action_of,
    monitored,
)
from onemap_planner.motion.motions import STOP, Motion, Pose2d
from onemap_planner.motion.pure_pursuit import (
    DriveParams,
    limit_acceleration,
    speed_on_map_mps,
    target_velocity,
)
from onemap_planner.world.costmap import Costmap
from onemap_shared.geometry import Velocity2d

BRAKE_S = 0.5  # zeros sent after the end: longer than the robot's deadman timer
LOOKAHEAD_PARTS = (1.0, 0.5, 0.25)  # of the lookahead distance, tried one after the other
MAX_CONTROL_PERIOD_S = 0.2  # after a pause the acceleration limit does not catch up


@dataclass(frozen=True, slots=True)
class Plan:
    """The motion of one planning step: for which search, on which costmap.

    made_s: before the map was asked for what the costmap shows; frame_ns: capture time of the
    newest frame in that, on the robot's clock, 0 if it is not known; places_version: of the places
    with the zones that the costmap has.
    """

    search_id: str
    motion: Motion
    costmap: Costmap
    made_s: float
    places_version: tuple[int, int] = (0, 0)
    frame_ns: int = 0


@dataclass(frozen=True, slots=True)
class ControllerInputs:
    """Inputs of one control step.

    search_id: of the active search, empty if none is; stale_reason: why the inputs are too old
    to move on, empty if they are not; map_age_s: of what the map shows, seconds; confirmed:
    whether the robot has named a command; loop_s: from a command to the odometry that names it;
    delivery_s: until the next command acts, beyond what the pose was carried on by;
    places_version: the newest, a plan made with another one does not know all zones.
    """

    now_s: float
    search_id: str
    pose: Pose2d | None
    stale_reason: str
    map_age_s: float = 0.0
    confirmed: bool = True
    loop_s: float = 0.0
    delivery_s: float = USUAL_DELIVERY_S
    places_version: tuple[int, int] = (0, 0)

    @property
    def may_move(self) -> bool:
        """Whether pose and loop are known and fresh."""
        return self.pose is not None and self.confirmed and not self.stale_reason


@dataclass(frozen=True, slots=True)
class VelocityController:
    """State of the controller. Seconds are of one monotonic clock.

    command: the last velocity, of ``at_s``, which holds for ``validity_s``; velocity: that the
    robot has by then, if it brakes no harder than its limits; wanted: the velocity that the plan
    asked for, before the costmap was checked; active_s: when a search was last active; stops: how
    often a moving robot was stopped because of stale inputs; monitor: how often the collision
    monitor intervened; frame_ns: of the plan that the command follows, 0 if it follows none.
    """

    command: Velocity2d = STOP
    velocity: Velocity2d = STOP
    validity_s: float = VALIDITIES_S[0]
    at_s: float = float("-inf")
    active_s: float = float("-inf")
    stops: int = 0
    wanted: Velocity2d = STOP
    monitor: MonitorCounts = field(default_factory=MonitorCounts)
    frame_ns: int = 0

    @property
    def blocked(self) -> bool:
        """Whether the costmap stops the robot, which the plan wants to move."""
        return self.wanted.speed_mps > 0 and self.command.speed_mps == 0.0

    def creeps(self, params: DriveParams) -> bool:
        """Whether the costmap allows only the speed at which the body comes over unseen floor."""
        return 0.0 < self.command.speed_mps <= params.unseen_mps < self.wanted.speed_mps

    def update(
        self,
        plan: Plan | None,
        inputs: ControllerInputs,
        params: DriveParams,
        *,
        max_plan_age_s: float,
    ) -> tuple[VelocityController, bool]:
        """The controller with its new command, and whether to send it.

        A stop is commanded at once, without ramp: the robot brakes as hard as it can.
        """
        now_s = inputs.now_s
        dt_s = min(max(now_s - self.at_s, 0.0), MAX_CONTROL_PERIOD_S)
        if not inputs.search_id:
            braking = now_s - self.active_s <= BRAKE_S
            return self._after(CheckedCommand(), STOP, params, dt_s=dt_s, now_s=now_s), braking
        valid = (
            plan is not None
            and plan.search_id == inputs.search_id
            and now_s - plan.made_s <= max_plan_age_s
            and plan.places_version == inputs.places_version
        )
        if plan is None or not valid or inputs.pose is None or not inputs.may_move:
            stops = self.stops + (self.command != STOP)
            stopped = self._after(CheckedCommand(), STOP, params, dt_s=dt_s, now_s=now_s)
            return replace(stopped, stops=stops, active_s=now_s), True
        track = PathTracker(params, dt_s, inputs.map_age_s, inputs.loop_s, inputs.delivery_s)
        wanted, checked = track.velocity(plan, inputs.pose, self.velocity)
        counts = self.monitor.counting(action_of(wanted, checked.velocity))
        moved = self._after(checked, wanted, params, dt_s=dt_s, now_s=now_s)
        return replace(moved, monitor=counts, active_s=now_s, frame_ns=plan.frame_ns), True

    def _after(
        self,
        checked: CheckedCommand,
        wanted: Velocity2d,
        params: DriveParams,
        *,
        dt_s: float,
        now_s: float,
    ) -> VelocityController:
        """The controller after this command."""
        return replace(
            self,
            command=checked.velocity,
            velocity=limit_acceleration(checked.velocity, self.velocity, dt_s, params),
            validity_s=checked.validity_s,
            wanted=wanted,
            at_s=now_s,
            frame_ns=0,
        )


@dataclass(frozen=True, slots=True)
class PathTracker:
    """Tracks a plan ``dt_s`` after the last command.

    map_age_s: of what the map shows when the planner has it; loop_s: seconds that commands and
    odometry travel, by which the map is older than that at most; delivery_s: see ``ControlTimes``.
    """

    params: DriveParams
    dt_s: float
    map_age_s: float = 0.0
    loop_s: float = 0.0
    delivery_s: float = USUAL_DELIVERY_S

    def velocity(
        self, plan: Plan, pose: Pose2d, previous: Velocity2d
    ) -> tuple[Velocity2d, CheckedCommand]:
        """The velocity that tracks the plan, and the command that the costmap allows.

        Where the arc to the lookahead point is not free, a nearer point is tried: the path is. It
        counts if the robot may drive faster to it: else creeping to the one and to the other, it
        turned to and fro.
        """
        first: Velocity2d | None = None
        best = CheckedCommand()
        slower = self._slowed()
        times = ControlTimes(self.dt_s, self.map_age_s + self.loop_s, self.delivery_s)
        for part in LOOKAHEAD_PARTS:
            target = target_velocity(plan.motion, pose, plan.costmap, slower, lookahead_part=part)
            wanted = limit_acceleration(target, previous, self.dt_s, self.params)
            command = monitored(wanted, previous, pose, plan.costmap, self.params, times=times)
            if first is None or command.velocity.speed_mps > best.velocity.speed_mps:
                best = command
            first = first or wanted
            if best.velocity == wanted:
                break
        return first or STOP, best

    def _slowed(self) -> DriveParams:
        """The parameters with the top speed that the age of the map allows."""
        speed_mps = speed_on_map_mps(self.map_age_s + self.loop_s, self.params)
        if speed_mps >= self.params.max_linear_mps:
            return self.params
        return self.params.model_copy(update={"max_linear_mps": speed_mps})
