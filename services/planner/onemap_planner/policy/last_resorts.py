"""What a search tries that has no goal left, before its object counts as not found."""

from __future__ import annotations

from collections.abc import Callable
from math import pi

from onemap_planner.motion.motions import Rotate
from onemap_planner.motion.pure_pursuit import LOOK_AROUND_RADPS
from onemap_planner.policy.context import PlanningContext, across_gaps
from onemap_planner.policy.evidence import doubtful
from onemap_planner.policy.outcome import Move
from onemap_planner.policy.state import SETTLE_S, PlannerState
from onemap_planner.policy.tell import not_found
from onemap_planner.search.state_machine import without_choice
from onemap_shared.messages import NO_DETAIL

# Square metres of free floor that no path leads to, from which on all frontiers are visited once
# more before the object counts as not found: a small room.
CUT_OFF_M2 = 2.0
LEAST_BEYOND_M2 = 0.3  # of floor beyond gaps that are worth crossing them: a doorway
MAX_LAST_LOOKS = 2  # doubtful candidates that are looked at again before an object is given up


def wait(state: PlannerState, _: PlanningContext) -> Move | None:
    """Stand for ``SETTLE_S``: the next view of the map may show a goal."""
    return Move() if state.idle_s() < SETTLE_S else None


def look_around(state: PlannerState, _: PlanningContext) -> Move | None:
    """Turn once: whoever stood in a doorway may have left."""
    turned_s = SETTLE_S + 2 * pi / LOOK_AROUND_RADPS
    return Move(Rotate()) if state.idle_s() < turned_s else None


def cross_gaps(state: PlannerState, context: PlanningContext) -> Move | None:
    """Let paths cross narrow gaps of unknown floor, if there is floor beyond them."""
    if state.crosses_gaps:
        return None
    beyond_m2 = context.unreachable_m2() - across_gaps(context).unreachable_m2()
    if beyond_m2 < LEAST_BEYOND_M2:
        return None
    state.idle_since_s = None
    state.crosses_gaps = True
    return Move()


def reconsider(state: PlannerState, context: PlanningContext) -> Move | None:
    """Look once more at what was rejected, given up on the way, cut off or is doubtful."""
    if state.reconsidered:
        return None
    cut_off = context.unreachable_m2() >= CUT_OFF_M2
    began_s = state.search.target_start.since_active_time_s
    # No goal since the object's turn came.
    untried = state.active_time_s - state.idle_s() - began_s < SETTLE_S
    again = (
        state.evidence.rejected
        or state.ledger.may_reconsider
        or ((cut_off or untried) and state.ledger.visited_frontiers)
    )
    doubted = doubtful(state, context)
    if not again and not doubted:
        return None
    looks = tuple(candidate for candidate, _ in doubted[:MAX_LAST_LOOKS])
    state.reconsider(frontiers=cut_off or untried, doubtful=looks)
    return Move()


def settle(state: PlannerState, _: PlanningContext) -> Move | None:
    """Walk up to an object of the name that is not as described, to say that it is there."""
    evidence = state.evidence
    known = evidence.supported
    if evidence.takes_any or evidence.other_finds or state.search.detail == NO_DETAIL:
        return None
    if not (known or evidence.unsupported):
        return None
    evidence.takes_any, state.idle_since_s = True, None
    evidence.candidates, evidence.unclear, evidence.mismatched = known, (), ()
    state.ledger.forget_looks()
    return Move()


# What a search without a goal tries, in this order.
LAST_RESORTS: tuple[Callable[[PlannerState, PlanningContext], Move | None], ...] = (
    wait,
    look_around,
    cross_gaps,
    reconsider,
    settle,
)


def last_resort(state: PlannerState, context: PlanningContext) -> Move:
    """The first of ``LAST_RESORTS`` that has something to do; else the object is not found."""
    state.active_goal, state.search = None, without_choice(state.search)
    tried = (resort(state, context) for resort in LAST_RESORTS)
    move = next((move for move in tried if move is not None), None)
    return move if move is not None else not_found(state, context)
