"""Why the planner drives to a goal: the goals that it weighed, and why one of them won."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

MAX_GOAL_OPTIONS = 5  # of one choice: the best, and the chosen one


@dataclass(frozen=True, slots=True)
class GoalOption:
    """A goal that was weighed.

    Attributes:
        kind: frontier, region, detection, go_to or look_at.
        xy_m: x, y in the map frame of what the robot would look at.
        score: similarity expected there, in [0, 1]; 0 for a place.
        travel_m: metres of way to where it would stand.
        utility: what goals are ranked by, in units of similarity: score and size less the way.
        chosen: whether the robot drives there.
    """

    kind: str
    xy_m: tuple[float, float]
    score: float
    travel_m: float
    utility: float
    chosen: bool

    def __post_init__(self) -> None:
        numbers = (*self.xy_m, self.score, self.travel_m, self.utility)
        if not all(isfinite(number) for number in numbers):
            raise ValueError(f"a weighed goal has the numbers {numbers}; all must be finite")


@dataclass(frozen=True, slots=True)
class GoalChoice:
    """A decision of the planner where to drive.

    Attributes:
        number: counts the decisions of a search, from 1; 0 before the first.
        sentence: why the chosen goal won; empty while the robot has no goal.
        options: at most 5 of the goals that were weighed, best first, the chosen one among them.
        left_out: number of goals that were weighed and are not in ``options``.
    """

    number: int = 0
    sentence: str = ""
    options: tuple[GoalOption, ...] = ()
    left_out: int = 0

    def __post_init__(self) -> None:
        if len(self.options) > MAX_GOAL_OPTIONS:
            raise ValueError(
                f"a choice has {len(self.options)} options; at most {MAX_GOAL_OPTIONS} are allowed"
            )


NO_CHOICE = GoalChoice()
