"""What a search does that has no goal left: look around, try once more, or end."""

from __future__ import annotations

from math import pi

from onemap_planner.motion.motions import Rotate
from onemap_planner.motion.pure_pursuit import LOOK_AROUND_RADPS
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.evidence import against_map
from onemap_planner.policy.outcome import Move
from onemap_planner.policy.state import SETTLE_S, PlannerState
from onemap_planner.policy.tell import not_found
from onemap_planner.search.state_machine import without_choice
from onemap_shared.messages import NO_DETAIL

TURNED_S = SETTLE_S + 2 * pi / LOOK_AROUND_RADPS  # of standing and turning once
MAX_LAST_LOOKS = 2  # of what was detected against the map, before an object is given up


def without_goal(state: PlannerState, context: PlanningContext) -> Move:
    """Stand for ``SETTLE_S``: the next view of the map may show a goal. Then turn once: whoever
    stood in a doorway may have left. Then offer once more what was tried. Then it is not found."""
    state.active_goal, state.search = None, without_choice(state.search)
    idle_s = state.idle_s()
    if idle_s < SETTLE_S:
        return Move()
    if idle_s < TURNED_S:
        return Move(Rotate())
    if reconsider(state, context) or take_any(state):
        return Move()
    return not_found(state, context)


def reconsider(state: PlannerState, context: PlanningContext) -> bool:
    """Offer once more, for each object, what was tried in vain, and what was detected
    against the map."""
    doubted = against_map(state, context)
    if state.reconsidered or not (doubted or state.evidence.rejected or state.ledger.attempts):
        return False
    state.reconsider(tuple(candidate for candidate, _ in doubted[:MAX_LAST_LOOKS]))
    return True


def take_any(state: PlannerState) -> bool:
    """Take any object of the name, to say that it is there, though not as described."""
    evidence = state.evidence
    known = evidence.supported
    if evidence.takes_any or evidence.other_finds or state.search.detail == NO_DETAIL:
        return False
    if not (known or evidence.unsupported):
        return False
    evidence.takes_any, state.idle_since_s = True, None
    evidence.candidates, evidence.unclear, evidence.mismatched = known, (), ()
    state.ledger.forget_looks()
    return True
