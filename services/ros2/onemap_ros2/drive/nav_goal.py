"""The one goal of nav2 that the adapter has: its states, and what is asked of nav2 next."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

from onemap_ros2.config import Nav2Params
from onemap_ros2.drive.goal_pose import GoalPose
from onemap_ros2.drive.navigate_action import GOAL_ENDED, GOAL_UNKNOWN, GoalResult

SOON = float("-inf")


class GoalPhase(Enum):
    """Where the goal stands.

    NONE: there is none. ASKING: it was sent and is not answered. DRIVING: nav2 accepted it.
    CANCELLING: it must end, and nav2 has not said that it did.
    """

    NONE = "none"
    ASKING = "asking"
    DRIVING = "driving"
    CANCELLING = "cancelling"


class Order(Enum):
    """What to ask of nav2 now."""

    NOTHING = "nothing"
    SEND = "send"
    CANCEL = "cancel"


@dataclass(frozen=True, slots=True)
class Heard:
    """What nav2 said since the last step.

    Attributes:
        served: whether a node serves the action.
        accepted: the answer to the goal; None while there is none.
        result: how the goal ended; None while it has not.
        cancel_code: the answer to a cancellation; None while there is none.
        lost: the question for the result ended without an answer: the link or nav2 is gone.
    """

    served: bool = True
    accepted: bool | None = None
    result: GoalResult | None = None
    cancel_code: int | None = None
    lost: bool = False


@dataclass(frozen=True, slots=True)
class NavGoal:
    """The goal and its state. Times are seconds of a monotonic clock.

    Attributes:
        phase: see ``GoalPhase``.
        target: of the newest goal; None before the first.
        since_s: since when the phase lasts, or when the cancellation was last asked for.
        sent_s: when the newest goal was sent.
        next_s: before this no goal is sent: nav2 refused or ended the last one.
        replaces: the newest goal takes the place of one that nav2 drives to.
    """

    phase: GoalPhase = GoalPhase.NONE
    target: GoalPose | None = None
    since_s: float = SOON
    sent_s: float = SOON
    next_s: float = SOON
    replaces: bool = False

    def step(
        self, now_s: float, wanted: GoalPose | None, heard: Heard, params: Nav2Params
    ) -> tuple[NavGoal, Order]:
        """The goal after this moment, and what to ask of nav2. ``wanted`` None: it must end."""
        match self.phase:
            case GoalPhase.NONE:
                return self._without(now_s, wanted, heard, params)
            case GoalPhase.ASKING:
                return self._asking(now_s, heard, params)
            case GoalPhase.DRIVING:
                return self._driving(now_s, wanted, heard, params)
            case GoalPhase.CANCELLING:
                return self._cancelling(now_s, heard, params)

    def _without(
        self, now_s: float, wanted: GoalPose | None, heard: Heard, params: Nav2Params
    ) -> tuple[NavGoal, Order]:
        if wanted is None or not heard.served:
            return self, Order.NOTHING
        moved = self.target is None or self._moved(wanted, params)
        due_s = self.sent_s + params.goal_period_s if moved else self.next_s
        return (self, Order.NOTHING) if now_s < due_s else self._sent(now_s, wanted)

    def _asking(self, now_s: float, heard: Heard, params: Nav2Params) -> tuple[NavGoal, Order]:
        if heard.accepted:
            return replace(self, phase=GoalPhase.DRIVING, since_s=now_s), Order.NOTHING
        if heard.accepted is False and not self.replaces:
            return self._ended(now_s, params), Order.NOTHING
        if heard.accepted is False or now_s - self.since_s > params.answer_s:
            return self._cancel(now_s)  # the goal before it, or this one: its answer may be lost
        return self, Order.NOTHING

    def _driving(
        self, now_s: float, wanted: GoalPose | None, heard: Heard, params: Nav2Params
    ) -> tuple[NavGoal, Order]:
        if heard.result is not None:
            return self._ended(now_s, params), Order.NOTHING
        if wanted is None or heard.lost:
            return self._cancel(now_s)
        if self._moved(wanted, params) and now_s >= self.sent_s + params.goal_period_s:
            return self._sent(now_s, wanted)
        return self, Order.NOTHING

    def _cancelling(self, now_s: float, heard: Heard, params: Nav2Params) -> tuple[NavGoal, Order]:
        if heard.result is not None or heard.cancel_code in (GOAL_UNKNOWN, GOAL_ENDED):
            return replace(self, phase=GoalPhase.NONE, next_s=now_s), Order.NOTHING
        return (
            self._cancel(now_s) if now_s - self.since_s > params.answer_s else (self, Order.NOTHING)
        )

    def _moved(self, wanted: GoalPose, params: Nav2Params) -> bool:
        return self.target is not None and wanted.differs(
            self.target, params.goal_change_m, params.goal_change_rad
        )

    def _sent(self, now_s: float, wanted: GoalPose) -> tuple[NavGoal, Order]:
        replaces = self.phase is GoalPhase.DRIVING
        sent = NavGoal(GoalPhase.ASKING, wanted, now_s, now_s, replaces=replaces)
        return sent, Order.SEND

    def _cancel(self, now_s: float) -> tuple[NavGoal, Order]:
        return replace(self, phase=GoalPhase.CANCELLING, since_s=now_s), Order.CANCEL

    def _ended(self, now_s: float, params: Nav2Params) -> NavGoal:
        return replace(self, phase=GoalPhase.NONE, since_s=now_s, next_s=now_s + params.retry_s)
