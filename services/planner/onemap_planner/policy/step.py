"""One planning step: take in what is new, decide how to move, and end what is to be ended.

1. ``take_in``: time, pose, map and detections become the state and a context to plan on.
2. ``next_move``: what the phase of the search asks for. While it explores: ``offer`` lists all
   goals, ``choose`` takes the best; else the way to a candidate, or to a place. The reasons are
   told with the choice (``tell``).
3. ``hindered``: a goal is given up that the robot got stuck on the way to.
4. ``limit_reached``: the limits of time and distance end the search, whatever else has happened.
5. The events change the state.

Pure: time comes in with the observation, and the state that comes in stays as it is. The planning
thread feeds it from the bus, the tests from a grid world.
"""

from __future__ import annotations

from onemap_planner.motion.motions import Reverse
from onemap_planner.policy.limits import hindered, limit_reached, patience_over
from onemap_planner.policy.move import Exploration, explore, next_move
from onemap_planner.policy.outcome import Decision, Observation, Outcome
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.take_in import take_in
from onemap_planner.policy.tell import finds_of
from onemap_planner.world.candidates import CONSENSUS, Consensus


def step(
    state: PlannerState,
    observation: Observation,
    params: PlannerParams,
    exploration: Exploration = explore,
    consensus: Consensus = CONSENSUS,
) -> Outcome:
    """The state after the observation and what to do.

    exploration and consensus: those of another method, which a benchmark compares.
    """
    state = state.copy()
    taken = take_in(state, observation, params, consensus)
    stamp = observation.stamp(state.active_time_s)
    if taken is None:
        for ends in (patience_over, limit_reached):
            if (event := ends(state, observation)) is not None:
                state.apply(event, stamp)
        return Outcome(state)
    move, costmap = next_move(state, taken, exploration), taken.context.costmap
    goal = state.active_goal.goal if state.active_goal else None
    events = (*hindered(state, taken, observation), *((move.event,) if move.event else ()))
    limit = limit_reached(state, observation, params.explore.object_limit_s)
    if limit is not None:  # ends the search, or its object, whatever else this step has shown
        events = (limit,)
    finds = finds_of(state.search, events, costmap.grid)
    for event in events:
        state.apply(event, stamp)
    backs_up = state.progress is not None and state.progress.backing_from is not None
    motion = Reverse() if backs_up else move.motion
    return Outcome(state, Decision(motion, costmap, goal, move.areas, finds))
