"""The last resorts of a search that has no goal left, in the order in which they are tried."""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np

from onemap_planner.motion.motions import Rotate
from onemap_planner.motion.pure_pursuit import LOOK_AROUND_RADPS
from onemap_planner.policy.context import PlanningContext, across_gaps, coverage_of
from onemap_planner.policy.evidence import found_object_at, found_under_other_names, likely_disputed
from onemap_planner.policy.memory import SETTLE_S, PlannerState
from onemap_planner.policy.outcome import Move
from onemap_planner.search.state_machine import Ending
from onemap_planner.world.candidates import MIN_SIGHTINGS, ObjectCandidate
from onemap_shared.messages import Coverage, SearchState

# Square metres of free floor that no path leads to, from which on all frontiers are visited once
# more before the object counts as not found: a small room.
CUT_OFF_M2 = 2.0
LEAST_BEYOND_M2 = 0.3  # of floor beyond gaps that are worth crossing them: a doorway
LEAST_NAMED_M2 = 1.0  # less floor out of reach is the rim of furniture
MAX_LAST_LOOKS = 2  # doubtful candidates that are looked at again before an object is given up

Resort = Callable[[PlannerState, PlanningContext], Move | None]


def last_resort(state: PlannerState, context: PlanningContext) -> Move:
    """The first of ``LAST_RESORTS`` that has something to do; else the object is not found."""
    state.memory.active_goal = None
    tried = (resort(state, context) for resort in LAST_RESORTS)
    move = next((move for move in tried if move is not None), None)
    return move if move is not None else give_up(state, context)


def wait(state: PlannerState, _: PlanningContext) -> Move | None:
    """Stand for ``SETTLE_S``: the next view of the map may show a goal."""
    now_s = state.active_time_s
    return Move() if now_s - state.memory.idle_from_s(now_s) < SETTLE_S else None


def look_around(state: PlannerState, _: PlanningContext) -> Move | None:
    """Turn once: whoever stood in a doorway may have left."""
    now_s, turned_s = state.active_time_s, SETTLE_S + 2 * pi / LOOK_AROUND_RADPS
    return Move(Rotate()) if now_s - state.memory.idle_from_s(now_s) < turned_s else None


def cross_gaps(state: PlannerState, context: PlanningContext) -> Move | None:
    """Let paths cross narrow gaps of unknown floor, if there is floor beyond them."""
    if state.crosses_gaps:
        return None
    beyond_m2 = context.unreachable_m2() - across_gaps(context).unreachable_m2()
    if beyond_m2 < LEAST_BEYOND_M2:
        return None
    state.memory.idle_since_s = None
    state.crosses_gaps = True
    return Move()


def reconsider(state: PlannerState, context: PlanningContext) -> Move | None:
    """Look once more at what was rejected, given up on the way, cut off or is doubtful."""
    memory = state.memory
    if memory.reconsidered:
        return None
    cut_off = context.unreachable_m2() >= CUT_OFF_M2
    began_s = state.search.target_start.since_active_time_s
    # No goal since the object's turn came.
    untried = memory.idle_from_s(state.active_time_s) - began_s < SETTLE_S
    again = (
        memory.rejected
        or memory.closed_off
        or state.unreached_frontiers
        or ((cut_off or untried) and state.visited_frontiers)
    )
    doubtful = _doubtful(state, context)
    if not again and not doubtful:
        return None
    looks = tuple(candidate for candidate, _ in doubtful[:MAX_LAST_LOOKS])
    state.reconsider(frontiers=cut_off or untried, doubtful=looks)
    return Move()


LAST_RESORTS: tuple[Resort, ...] = (wait, look_around, cross_gaps, reconsider)


def give_up(state: PlannerState, context: PlanningContext) -> Move:
    """The object counts as not found; the reason says what was looked at."""
    coverage, doubtful = coverage_of(context), _doubtful(state, context)
    named = f"; {_told(*doubtful[0])}" if doubtful else ""
    outcome, reason = SearchState.NOT_FOUND, _covered(state, context, coverage) + named
    return Move(event=Ending(outcome, reason, coverage=coverage))


def _doubtful(state: PlannerState, context: PlanningContext) -> list[tuple[ObjectCandidate, float]]:
    """What was detected, but not accepted because the map did not agree, the most probable first.

    Each with its probability; what is certainly something else is left out.
    """
    unsupported = [
        candidate
        for candidate in (*state.memory.disputed, *state.memory.rejected)
        if not candidate.supported and candidate.sightings >= MIN_SIGHTINGS
    ]
    return sorted(likely_disputed(unsupported, context), key=lambda pair: -pair[1])


def _told(best: ObjectCandidate, probable: float) -> str:
    """A doubtful candidate in words."""
    hits = sum(tally.hits for tally in best.near_views)
    x, y, _ = best.xyz
    return (
        f"detected at ({x:.1f}, {y:.1f}) in {hits} of {best.near_frames} near views where the map "
        f"does not agree, probability {probable:.2f}"
    )


def _covered(state: PlannerState, context: PlanningContext, coverage: Coverage) -> str:
    """How much was explored, and where the similarity to the object is highest."""
    map_view = context.map_view
    area_m2 = float(map_view.explored.sum()) * map_view.cell_area_m2
    text = f"searched everything reachable: {area_m2:.0f} m² explored"
    if coverage.unreachable_m2 >= LEAST_NAMED_M2:
        text += f", {coverage.unreachable_m2:.0f} m² of floor seen that no way leads to"
    if not coverage.best_match_m:
        return f"{text}; the map has no features"
    x, y = coverage.best_match_m
    (cell,) = map_view.world_cells(map_view.grid.cells(np.array([[x, y]])))
    others = found_under_other_names(state.found_objects, state.search.target, state.synonyms)
    found_object = found_object_at(cell, others)
    there = f", which is the {found_object.name} found before" if found_object else ""
    return f"{text}; best match {coverage.best_score:.2f} at ({x:.1f}, {y:.1f}){there}"
