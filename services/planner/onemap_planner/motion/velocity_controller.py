"""The helm: twenty times a second, the order of the last plan becomes a command or a stop."""

from __future__ import annotations

from dataclasses import dataclass, replace

from onemap_planner.motion.pure_pursuit import STILL, Pose, Velocity, limited, steer
from onemap_planner.policy.params import Rules
from onemap_planner.policy.step import Decision

BRAKE_S = 0.5  # zeros sent after the end: longer than the robot's deadman timer
LONGEST_STEP_S = 0.2  # after a pause the acceleration limit does not catch up


@dataclass(frozen=True, slots=True)
class Order:
    """A decision, for which search, and when it was made (seconds)."""

    search_id: str
    decision: Decision
    made_s: float


@dataclass(frozen=True, slots=True)
class Helm:
    """The state of steering.

    command: the last one, of at_s; active_s: when a search was last active; stops: how often
    moving had to be broken off because the senses were stale.
    """

    command: Velocity = STILL
    at_s: float = float("-inf")
    active_s: float = float("-inf")
    stops: int = 0


@dataclass(frozen=True, slots=True)
class HelmSenses:
    """What steering goes by.

    search_id: of the active search, empty if none is; complaint: why not to move now, or empty.
    """

    now_s: float
    search_id: str
    pose: Pose | None
    complaint: str


def tick(helm: Helm, order: Order | None, senses: HelmSenses, rules: Rules) -> tuple[Helm, bool]:
    """The helm with its new command, and whether to send it.

    Stops are at once, without ramp: the robot brakes as hard as it can.
    """
    now_s = senses.now_s
    if not senses.search_id:
        braking = now_s - helm.active_s <= BRAKE_S
        return replace(helm, command=STILL, at_s=now_s), braking
    helm = replace(helm, active_s=now_s)
    valid = (
        order is not None
        and order.search_id == senses.search_id
        and now_s - order.made_s <= rules.freshness.max_plan_age_s
    )
    if order is None or not valid or senses.pose is None or senses.complaint:
        moving = helm.command != STILL
        return replace(helm, command=STILL, at_s=now_s, stops=helm.stops + moving), True
    wanted = steer(order.decision.motion, senses.pose, order.decision.terrain, rules.drive)
    dt_s = min(max(now_s - helm.at_s, 0.0), LONGEST_STEP_S)
    return replace(helm, command=limited(wanted, helm.command, dt_s, rules.drive), at_s=now_s), True
