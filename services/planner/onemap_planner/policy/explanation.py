"""Explains which goal was chosen: the best goals that were weighed, and why one of them won.

Computed only when a goal is chosen anew, from what the choice has computed already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite

from onemap_planner.policy.goals import Goal, GoalParams, GoalUtility
from onemap_planner.search.phases import Search
from onemap_shared.messages import MAX_GOAL_OPTIONS, GoalChoice, GoalOption

LEAST_GAIN = 0.005  # of utility that is named as a reason: half of what is printed


def explain_goal(search: Search, goal: Goal, options: Sequence[Goal], params: GoalParams) -> Search:
    """The search with the reasons for a goal that was chosen anew among the options."""
    return _numbered(search, explain(goal, options, params))


def explain_candidate(search: Search, goal: Goal, sightings: int, enough: int) -> Search:
    """The search with the reasons for walking up to a candidate."""
    sentence = (
        f"detected {sightings} times where the map agrees, {enough} are enough: it comes before "
        "every other goal"
    )
    return _numbered(search, GoalChoice(0, sentence, _options([goal], goal)))


def explain(goal: Goal, options: Sequence[Goal], params: GoalParams) -> GoalChoice:
    """The choice of ``goal`` among these options, numbered 0."""
    finite = [option for option in options if isfinite(option.utility.travel_m)]
    ranked = sorted(finite, key=lambda option: (-option.utility.total, option.look_xy))
    shown = ranked[:MAX_GOAL_OPTIONS]
    if goal in ranked and goal not in shown:
        shown[-1] = goal
    others = [option for option in ranked if option != goal]
    sentence = _sentence(goal, others[0] if others else None, params)
    return GoalChoice(0, sentence, _options(shown, goal), len(ranked) - len(shown))


def _numbered(search: Search, choice: GoalChoice) -> Search:
    return replace(search, choice=replace(choice, number=search.choice.number + 1))


def _options(goals: Sequence[Goal], chosen: Goal) -> tuple[GoalOption, ...]:
    return tuple(
        GoalOption(
            kind=str(goal.kind),
            xy_m=(float(goal.look_xy[0]), float(goal.look_xy[1])),
            score=float(goal.utility.score),
            travel_m=float(goal.utility.travel_m),
            utility=float(goal.utility.total),
            chosen=goal == chosen,
        )
        for goal in goals
    )


def _sentence(goal: Goal, rival: Goal | None, params: GoalParams) -> str:
    """Why the goal won against the best of the others."""
    if rival is None:
        return f"the only goal: {goal.reason}"
    ahead = goal.utility.total - rival.utility.total
    other = f"the {rival.kind} at ({rival.look_xy[0]:.1f}, {rival.look_xy[1]:.1f})"
    if ahead < 0:
        return (
            f"kept although {other} has {-ahead:.2f} more utility: the robot turns away from its "
            f"goal only for {100 * params.hysteresis:.0f} % more"
        )
    gains = _gains(goal.utility, rival.utility)
    why = f": {' and '.join(gains)}" if gains else ""
    return f"utility {goal.utility.total:.2f}, {ahead:.2f} more than {other}{why}"


def _gains(ours: GoalUtility, theirs: GoalUtility) -> list[str]:
    """What speaks for one goal against another, the weightiest first."""
    share = (ours.travel_share + theirs.travel_share) / 2
    value = (ours.score + ours.size_bonus + theirs.score + theirs.size_bonus) / 2
    parts = (
        (
            (ours.score - theirs.score) * share,
            f"it is more similar ({ours.score:.2f} against {theirs.score:.2f})",
        ),
        ((ours.size_bonus - theirs.size_bonus) * share, "it opens a wider view"),
        (
            (ours.travel_share - theirs.travel_share) * value,
            f"its way is shorter ({ours.travel_m:.1f} m against {theirs.travel_m:.1f} m)",
        ),
    )
    ranked = sorted((part for part in parts if part[0] >= LEAST_GAIN), key=lambda p: -p[0])
    return [text for _, text in ranked]
