"""Goals: where to go next and why; selection by utility, with hysteresis."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

import numpy as np
from pydantic import Field, PositiveFloat

from onemap_planner.world.frontier import Frontier
from onemap_planner.world.map_view import WorldCells
from onemap_planner.world.regions import SimilarRegion
from onemap_shared.params import Params

GROWTH_CELLS = 2  # by which a border recedes between two plans: 0.2 m at most


MAX_LEFT = 8  # goals that were left; more do not take turns
RETURN_PART = 1 / 3  # of a goal's base time: one that comes and goes has three visits


class GoalKind(str, Enum):
    """What a goal is for; the values are those of ``PlannedPath.goal_kind``."""

    FRONTIER = "frontier"
    REGION = "region"
    DETECTION = "detection"
    GO_TO = "go_to"
    LOOK_AT = "look_at"

    def __str__(self) -> str:
        return self.value


class GoalParams(Params):
    """How goals are weighed against each other."""

    former_keys: ClassVar[Mapping[str, str]] = {
        "keep_margin": "hysteresis",
        "stand_within_m": "viewpoint_within_m",
    }

    half_value_m: PositiveFloat = Field(
        default=4.0,
        description="Metres of path at which a goal is worth half as much as here: a room. Far "
        "goals go by likeness per metre, whatever the encoder's scores are.",
    )
    size_weight_per_m: float = Field(
        default=0.04, ge=0, description="Bonus per metre of frontier: wide openings show more."
    )
    hysteresis: float = Field(
        default=0.3,
        ge=0,
        description="Part of the current goal's utility by which another must exceed it to "
        "replace it: what turning round costs, and borders change with every view.",
    )
    same_goal_m: PositiveFloat = Field(
        default=0.8, description="Metres a goal may shift between two maps and still be the same."
    )
    viewpoint_within_m: PositiveFloat = Field(
        default=0.8, description="Metres from which a frontier counts as reached."
    )
    view_nearest_m: PositiveFloat = Field(
        default=0.8, description="Metres; nearer, the camera looks over low things."
    )
    view_farthest_m: PositiveFloat = Field(
        default=1.5, description="Metres; farther, small things are too few pixels."
    )


@dataclass(frozen=True, slots=True)
class GoalUtility:
    """Utility of a goal, in units of similarity: the part of score and size that the path leaves.

    travel_share: that part, 1 here, 1/2 at ``half_value_m``, 0 without a path.
    """

    score: float
    size_bonus: float
    travel_m: float
    travel_share: float

    @property
    def total(self) -> float:
        """The number that goals are ranked by."""
        return (self.score + self.size_bonus) * self.travel_share

    @classmethod
    def of_place(cls, travel_m: float) -> GoalUtility:
        """Utility of a place ``travel_m`` away: only the path counts, it has no similarity."""
        return cls(score=0.0, size_bonus=0.0, travel_m=travel_m, travel_share=1.0)

    @classmethod
    def of(
        cls, score: float, travel_m: float, params: GoalParams, *, length_m: float = 0.0
    ) -> GoalUtility:
        """Utility of a similarity, ``travel_m`` away, at a frontier of ``length_m``."""
        return cls(
            score=score,
            size_bonus=params.size_weight_per_m * length_m,
            travel_m=float(travel_m),
            travel_share=1.0 / (1.0 + float(travel_m) / params.half_value_m),
        )


@dataclass(frozen=True, slots=True)
class Goal:
    """Drive to viewpoint_xy and face look_xy, (2,) metres each.

    cells: what it is about, by which it is recognised on the next map; empty for a place.
    """

    kind: GoalKind
    viewpoint_xy: tuple[float, float]
    look_xy: tuple[float, float]
    utility: GoalUtility
    reason: str
    cells: WorldCells = frozenset()

    def looks_at(self, xy: tuple[float, float], within_m: float) -> bool:
        """Whether ``look_xy`` lies within ``within_m`` of a point (metres)."""
        return float(np.hypot(self.look_xy[0] - xy[0], self.look_xy[1] - xy[1])) <= within_m


@dataclass(frozen=True, slots=True)
class GoalCandidates:
    """Frontiers and regions of one planning step."""

    frontiers: tuple[Frontier, ...] = ()
    regions: tuple[SimilarRegion, ...] = ()


def select_goal(options: Iterable[Goal], current: Goal | None, params: GoalParams) -> Goal | None:
    """The best option; the current goal's new version unless the best exceeds it by hysteresis."""
    ranked = sorted(options, key=lambda goal: (-goal.utility.total, goal.look_xy))
    if not ranked:
        return None
    best = ranked[0]
    if current is None:
        return best
    same = successor(ranked, current, params)
    if same is not None and best.utility.total < same.utility.total * (1 + params.hysteresis):
        return same
    return best


def successor(goals: Iterable[Goal], earlier: Goal, params: GoalParams) -> Goal | None:
    """Which of the goals is the earlier one on a newer map; None if it is gone.

    The goal of its kind that shares the most cells with it, since the middle of a border jumps
    when a part of it was seen or it is cut elsewhere; cells up to ``GROWTH_CELLS`` away count,
    because a border recedes. Without any such, the first within ``same_goal_m``.
    """
    alike = [goal for goal in goals if goal.kind is earlier.kind]
    around = _grown(earlier.cells)
    shared = [len(goal.cells & around) for goal in alike]
    if max(shared, default=0) > 0:
        return alike[shared.index(max(shared))]
    near = (goal for goal in alike if goal.looks_at(earlier.look_xy, params.same_goal_m))
    return next(near, None)


def _grown(cells: WorldCells) -> WorldCells:
    """The cells and all within ``GROWTH_CELLS`` of them, diagonals included."""
    steps = range(-GROWTH_CELLS, GROWTH_CELLS + 1)
    return frozenset((x + dx, y + dy) for x, y in cells for dx in steps for dy in steps)


@dataclass(frozen=True, slots=True)
class LeftGoal:
    """A goal that another one was preferred to, and the seconds that were spent on it."""

    goal: Goal
    spent_s: float


def with_left(
    left: tuple[LeftGoal, ...], before: LeftGoal, chosen: Goal, params: GoalParams
) -> tuple[LeftGoal, ...]:
    """The goals that were left, with the one before if ``chosen`` replaces it.

    Two goals may take turns for ever: one that is seen only from some places is preferred there
    and gone elsewhere. What was spent on a goal is therefore kept when another one is preferred.
    """
    if successor([chosen], before.goal, params) is not None:
        return left
    others = tuple(each for each in left if not _about_the_same(each.goal, before.goal, params))
    return (*others, before)[-MAX_LEFT:]


def spent_before_s(
    left: tuple[LeftGoal, ...], goal: Goal, params: GoalParams, *, base_s: float
) -> float:
    """Seconds that count as spent on a goal that is taken up: what was, and a part of the base
    time for each return; 0 for a new one."""
    for each in left:
        if _about_the_same(each.goal, goal, params):
            return each.spent_s + RETURN_PART * base_s
    return 0.0


def _about_the_same(a: Goal, b: Goal, params: GoalParams) -> bool:
    return a.kind is b.kind and a.looks_at(b.look_xy, params.same_goal_m)
