"""Exploring: which goal to pursue, and when to let go of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from onemap_planner.motion.pure_pursuit import Motion, Rest, arrived
from onemap_planner.policy import state
from onemap_planner.policy.competition import claim_at, of_others
from onemap_planner.policy.context import Situation
from onemap_planner.policy.goals import (
    Goal,
    GoalKind,
    Worth,
    choose,
    frontier_goals,
    region_goals,
)
from onemap_planner.policy.params import Rules
from onemap_planner.policy.state import Mind, Pursuit
from onemap_planner.policy.verify import find_stand
from onemap_planner.search.phases import Event, Exhausted, Spotted
from onemap_planner.world.frontiers import Frontier, find_frontiers
from onemap_planner.world.regions import Region, find_regions, remaining_regions

MAX_HINTS = 5  # candidates that are given a thought at once


@dataclass(frozen=True, slots=True)
class Landmarks:
    """What there is to go for."""

    frontiers: tuple[Frontier, ...] = ()
    regions: tuple[Region, ...] = ()


def spot(mind: Mind, situation: Situation, rules: Rules) -> Event | None:
    """The candidate to walk up to, if one has been seen often enough and can be reached."""
    for candidate in mind.quest.candidates[:MAX_HINTS]:
        if candidate.sightings < rules.consensus.min_sightings:
            continue
        if candidate.against > candidate.sightings:
            continue  # more often seen as something else
        if find_stand(candidate, situation, rules.explore) is not None:
            return Spotted(candidate)
    return None


def explore(
    mind: Mind, situation: Situation, rules: Rules
) -> tuple[Mind, Motion, Event | None, Landmarks]:
    """Pursue the best goal; no goal for a while means that everything has been searched."""
    landmarks = Landmarks(
        find_frontiers(situation.belief, situation.terrain, rules.frontier),
        find_regions(situation.belief, rules.region),
    )
    mind = _let_go(mind, rules)
    goal = choose(
        _options(mind, situation, landmarks, rules),
        mind.quest.pursuit.goal if mind.quest.pursuit else None,
        rules.goal,
    )
    if goal is None:
        return *_idle(mind, situation, rules), landmarks
    motion = situation.drive_to(goal.stand_xy, goal.look_xy)
    pursuit = _pursue(mind, goal, rules)
    if pursuit.arrived_s is None and arrived(motion, situation.pose, rules.drive):
        pursuit = replace(pursuit, arrived_s=mind.attentive_s)
    quest = replace(mind.quest, pursuit=pursuit, idle_since_s=None)
    return replace(mind, quest=quest), motion, None, landmarks


def _options(mind: Mind, situation: Situation, landmarks: Landmarks, rules: Rules) -> list[Goal]:
    terrain, reach = situation.terrain, situation.reach
    goals = frontier_goals(landmarks.frontiers, terrain, reach, rules=rules.goal)
    goals += _region_goals(mind, situation, landmarks.regions, rules)
    goals += _hint_goals(mind, situation, rules)
    worthwhile = _unshunned(mind, goals, rules)
    if worthwhile:
        return worthwhile
    remaining = remaining_regions(situation.belief, rules.region)
    return _unshunned(mind, _region_goals(mind, situation, remaining, rules), rules)


def _region_goals(
    mind: Mind, situation: Situation, regions: tuple[Region, ...], rules: Rules
) -> list[Goal]:
    tried = [goal.stand_xy for goal in mind.quest.shunned if goal.kind is GoalKind.REGION]
    return region_goals(
        regions,
        situation.terrain,
        situation.reach,
        tried_xy=np.array(tried, np.float64).reshape(-1, 2),
        rules=rules.goal,
    )


def _unshunned(mind: Mind, goals: list[Goal], rules: Rules) -> list[Goal]:
    return [goal for goal in goals if not state.is_shunned(mind, goal, rules.explore.shun_m)]


def _hint_goals(mind: Mind, situation: Situation, rules: Rules) -> list[Goal]:
    """A closer look at what has been seen, but not often enough to be believed."""
    goals = []
    hints = [c for c in mind.quest.candidates if c.sightings < rules.consensus.min_sightings]
    for candidate in hints[:MAX_HINTS]:
        stand_xy = find_stand(candidate, situation, rules.explore)
        if stand_xy is None:
            continue
        cell = situation.terrain.grid.cells(np.asarray(stand_xy))
        travel_m = float(situation.reach.cost_m[cell[0], cell[1]])
        worth = Worth(candidate.match, 0.0, travel_m, rules.goal.travel_weight_per_m * travel_m)
        reason = (
            f"detection: seen {candidate.sightings} times, similarity {candidate.match:.2f}, "
            f"a closer look {travel_m:.1f} m away"
        )
        look_xy = (candidate.xyz[0], candidate.xyz[1])
        goals.append(Goal(GoalKind.DETECTION, stand_xy, look_xy, worth, reason))
    return goals


def _let_go(mind: Mind, rules: Rules) -> Mind:
    """Shun a goal that was visited and stayed, or takes too long."""
    pursuit = mind.quest.pursuit
    if pursuit is None:
        return mind
    visited = (
        pursuit.arrived_s is not None
        and mind.attentive_s - pursuit.arrived_s >= rules.explore.linger_s
    )
    late = mind.attentive_s - pursuit.since_s > pursuit.budget_s
    return state.shun(mind, pursuit.goal) if visited or late else mind


def _pursue(mind: Mind, goal: Goal, rules: Rules) -> Pursuit:
    """The pursuit of this goal: the present one, its goal updated, or a new one."""
    pursuit = mind.quest.pursuit
    if (
        pursuit is not None
        and pursuit.goal.kind is goal.kind
        and goal.is_about(pursuit.goal.look_xy, rules.goal.same_goal_m)
    ):
        return replace(pursuit, goal=goal)
    budget_s = rules.explore.goal_base_s + rules.explore.goal_s_per_m * goal.worth.travel_m
    return Pursuit(goal, mind.attentive_s, budget_s)


def _idle(mind: Mind, situation: Situation, rules: Rules) -> tuple[Mind, Motion, Event | None]:
    since_s = mind.quest.idle_since_s
    if since_s is None:
        since_s = mind.attentive_s
    mind = replace(mind, quest=replace(mind.quest, pursuit=None, idle_since_s=since_s))
    if mind.attentive_s - since_s < rules.explore.settle_s:
        return mind, Rest(), None
    if mind.quest.rejected and not mind.quest.reconsidered:
        return state.reconsider(mind), Rest(), None
    return mind, Rest(), Exhausted(_covered(mind, situation))


def _covered(mind: Mind, situation: Situation) -> str:
    """How much was searched, and what came nearest to the object."""
    belief = situation.belief
    area_m2 = float(belief.explored.sum()) * belief.cell_area_m2
    text = f"searched everything reachable: {area_m2:.0f} m² explored"
    similarity = np.nan_to_num(belief.similarity, nan=-1.0)
    best = np.unravel_index(int(np.argmax(similarity)), similarity.shape)
    if similarity[best] < 0:
        return f"{text}; the map has no features"
    x, y = belief.grid.centres(np.array(best))
    cell = np.array(best) + np.asarray(belief.grid.origin_cell)
    others = of_others(mind.claims, mind.search.target, mind.synonyms)
    claim = claim_at((int(cell[0]), int(cell[1])), others)
    there = f", which is the {claim.name} found before" if claim else ""
    return f"{text}; best match {similarity[best]:.2f} at ({x:.1f}, {y:.1f}){there}"
