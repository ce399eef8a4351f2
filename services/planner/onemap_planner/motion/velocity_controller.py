"""The helm: twenty times a second, the order of the last plan becomes a command or a stop."""

from __future__ import annotations

from dataclasses import dataclass, replace

from onemap_planner.motion.motions import STOP, Pose2d
from onemap_planner.motion.pure_pursuit import limit_acceleration, target_velocity
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.step import Decision
from onemap_shared.geometry import Velocity2d

BRAKE_S = 0.5  # zeros sent after the end: longer than the robot's deadman timer
MAX_CONTROL_PERIOD_S = 0.2  # after a pause the acceleration limit does not catch up


@dataclass(frozen=True, slots=True)
class Plan:
    """A decision, for which search, and when it was made (seconds)."""

    search_id: str
    decision: Decision
    made_s: float


@dataclass(frozen=True, slots=True)
class VelocityController:
    """The state of steering.

    command: the last one, of at_s; active_s: when a search was last active; stops: how often
    moving had to be broken off because the senses were stale.
    """

    command: Velocity2d = STOP
    at_s: float = float("-inf")
    active_s: float = float("-inf")
    stops: int = 0


@dataclass(frozen=True, slots=True)
class ControllerInputs:
    """What steering goes by.

    search_id: of the active search, empty if none is; complaint: why not to move now, or empty.
    """

    now_s: float
    search_id: str
    pose: Pose2d | None
    stale_reason: str


def update_command(
    controller: VelocityController,
    plan: Plan | None,
    observation: ControllerInputs,
    params: PlannerParams,
) -> tuple[VelocityController, bool]:
    """The helm with its new command, and whether to send it.

    Stops are at once, without ramp: the robot brakes as hard as it can.
    """
    now_s = observation.now_s
    if not observation.search_id:
        braking = now_s - controller.active_s <= BRAKE_S
        return replace(controller, command=STOP, at_s=now_s), braking
    controller = replace(controller, active_s=now_s)
    valid = (
        plan is not None
        and plan.search_id == observation.search_id
        and now_s - plan.made_s <= params.staleness.max_plan_age_s
    )
    if plan is None or not valid or observation.pose is None or observation.stale_reason:
        moving = controller.command != STOP
        return replace(controller, command=STOP, at_s=now_s, stops=controller.stops + moving), True
    wanted = target_velocity(
        plan.decision.motion, observation.pose, plan.decision.costmap, params.drive
    )
    dt_s = min(max(now_s - controller.at_s, 0.0), MAX_CONTROL_PERIOD_S)
    return replace(
        controller,
        command=limit_acceleration(wanted, controller.command, dt_s, params.drive),
        at_s=now_s,
    ), True
