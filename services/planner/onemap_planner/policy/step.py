"""One thought: from what is sensed now and remembered to what the robot does next.

Pure: time comes in, a decision goes out, and the mind is a value. The service feeds it
from the bus; the tests feed it from a grid world.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from onemap_planner.motion.progress import Footing, feel
from onemap_planner.motion.pure_pursuit import Motion, Pose, Rest, Reverse, Spin, Velocity
from onemap_planner.policy import state
from onemap_planner.policy.competition import claimant, contested, of_others, with_claim
from onemap_planner.policy.context import Situation, take_in
from onemap_planner.policy.explore import Landmarks, explore, spot
from onemap_planner.policy.goals import Goal
from onemap_planner.policy.params import Rules
from onemap_planner.policy.state import Mind, Quest
from onemap_planner.policy.verify import approach, confirm, latest, reject
from onemap_planner.search.phases import (
    Approaching,
    Begun,
    Broken,
    Confirmed,
    Confirming,
    Event,
    Exhausted,
    Exploring,
    GivenUp,
    Looking,
    MapLost,
    Moment,
    Rejected,
    Starting,
    Turned,
)
from onemap_planner.search.state_machine import transition
from onemap_planner.world.candidates import Candidate, agrees, remember, sightings_of
from onemap_planner.world.costmap import Terrain
from onemap_shared.geometry import wrap_angle
from onemap_shared.messages import Detections, SearchView

LONGEST_THOUGHT_S = 1.0  # more than this between two thoughts is no attention
LOST_PART = 0.5  # a map that shrinks to less than this began anew


@dataclass(frozen=True, slots=True)
class Senses:
    """What is known at the time of a thought.

    pose None: no odometry yet; view None: the map has not answered. detections: all that
    came since the last thought, oldest first. command: the velocity last sent. complaint:
    why the senses are not to be trusted now; empty if they are.
    """

    now_s: float
    pose: Pose | None
    odometer_m: float
    command: Velocity
    collided: bool
    view: SearchView | None
    detections: tuple[Detections, ...]
    complaint: str


@dataclass(frozen=True, slots=True)
class Decision:
    """What to do until the next thought, and what led to it."""

    motion: Motion
    terrain: Terrain
    goal: Goal | None
    landmarks: Landmarks


def think(mind: Mind, senses: Senses, rules: Rules) -> tuple[Mind, Decision | None]:
    """The next state of mind and what to do; no decision while the senses are not fresh."""
    mind = _attend(mind, senses)
    if senses.complaint or senses.pose is None or senses.view is None:
        return _endure(mind, senses, rules), None
    before = mind.pose or senses.pose
    mind = state.walked(mind, senses.pose)
    mind, bumped = _feel(mind, senses, rules)
    situation = take_in(mind, senses.pose, senses.view, rules)
    mind = _notice(mind, senses, situation, rules)
    turned_rad = max(0.0, wrap_angle(senses.pose.yaw_rad - before.yaw_rad))
    mind, decision, events = _act(mind, situation, turned_rad, rules)
    if bumped:
        mind, more = _bumped(mind, rules)
        events = (*more, *events)
    if mind.attentive_s - mind.search.leg.since_attentive_s > rules.explore.object_limit_s:
        limit_s = rules.explore.object_limit_s
        events = (GivenUp(f"not found within {limit_s:.0f} s, the limit for one object"),)
    for event in events:
        mind = _happen(mind, event, senses)
    if mind.footing is not None and mind.footing.backing_from is not None:
        decision = replace(decision, motion=Reverse())
    return mind, decision


def _attend(mind: Mind, senses: Senses) -> Mind:
    """Clocks: attentive seconds pass only while nothing is to complain about."""
    passed_s = 0.0 if mind.thought_s is None else senses.now_s - mind.thought_s
    if senses.complaint:
        since_s = senses.now_s if mind.stale_since_s is None else mind.stale_since_s
        return replace(mind, thought_s=senses.now_s, stale_since_s=since_s)
    return replace(
        mind,
        thought_s=senses.now_s,
        stale_since_s=None,
        attentive_s=mind.attentive_s + min(passed_s, LONGEST_THOUGHT_S),
    )


def _endure(mind: Mind, senses: Senses, rules: Rules) -> Mind:
    """Wait for the senses, but not for ever."""
    if mind.stale_since_s is None:
        return mind
    waited_s = senses.now_s - mind.stale_since_s
    if waited_s <= rules.explore.patience_s:
        return mind
    return _happen(mind, Broken(f"waited {waited_s:.0f} s: {senses.complaint}"), senses)


def _feel(mind: Mind, senses: Senses, rules: Rules) -> tuple[Mind, bool]:
    """The mind with its footing, and whether the robot got stuck just now."""
    assert senses.pose is not None
    if mind.footing is None:
        return replace(mind, footing=Footing(senses.pose, mind.attentive_s)), False
    footing = feel(
        mind.footing,
        senses.pose,
        command=senses.command,
        collided=senses.collided,
        now_s=mind.attentive_s,
        rules=rules.recovery,
    )
    bumped = footing.backing_from is not None and mind.footing.backing_from is None
    return replace(mind, footing=footing), bumped


def _notice(mind: Mind, senses: Senses, situation: Situation, rules: Rules) -> Mind:
    """The mind with the new sightings, and aware of a map that began anew."""
    known_m2 = situation.known_m2()
    if known_m2 < LOST_PART * mind.known_m2:
        mind = replace(mind, known_m2=known_m2, quest=Quest(), dead_ends=(), claims=())
        return _happen(mind, MapLost(), senses)
    candidates = mind.quest.candidates
    for detections in senses.detections:
        candidates = _sighted(candidates, detections, mind, situation, rules)
    others = of_others(mind.claims, mind.search.target, mind.synonyms)
    free = tuple(c for c in candidates if claimant(c, others, situation.belief) is None)
    return replace(mind, known_m2=known_m2, quest=replace(mind.quest, candidates=free))


def _sighted(
    candidates: tuple[Candidate, ...],
    detections: Detections,
    mind: Mind,
    situation: Situation,
    rules: Rules,
) -> tuple[Candidate, ...]:
    """The candidates after the detections of one frame."""
    target, belief, limits = mind.search.target, situation.belief, rules.consensus
    fresh = [
        sighting
        for sighting in sightings_of(
            target, detections, belief, seen_from=situation.pose.xy, rules=limits
        )
        if not any(agrees(gone, sighting, limits) for gone in mind.quest.rejected)
    ]
    candidates = remember(candidates, fresh, limits)
    return contested(candidates, detections, fresh, target=target, belief=belief, rules=limits)


def _act(
    mind: Mind, situation: Situation, turned_rad: float, rules: Rules
) -> tuple[Mind, Decision, tuple[Event, ...]]:
    """What the present phase does."""
    motion: Motion = Rest()
    event: Event | None = None
    landmarks = Landmarks()
    match mind.search.phase:
        case Starting():
            event = Begun(situation.known_around() < rules.explore.known_around)
        case Looking():
            motion, event = Spin(), spot(mind, situation, rules) or Turned(turned_rad)
        case Exploring():
            event = spot(mind, situation, rules)
            if event is None:
                mind, motion, event, landmarks = explore(mind, situation, rules)
            if isinstance(event, Exhausted) and _is_held(mind, situation, rules):
                event = _stuck(mind)  # nothing was searched: it could not get there
        case Approaching() as phase:
            mind, motion, event = approach(mind, phase, situation, rules)
        case Confirming() as phase:
            mind, motion, event = confirm(mind, phase, situation, rules)
        case _:
            pass
    goal = mind.quest.pursuit.goal if mind.quest.pursuit else None
    decision = Decision(motion, situation.terrain, goal, landmarks)
    return mind, decision, () if event is None else (event,)


def _bumped(mind: Mind, rules: Rules) -> tuple[Mind, tuple[Event, ...]]:
    """After too many bumps in one place give up the goal, after twice as many the search."""
    assert mind.footing is not None
    bumps = mind.footing.bumps
    if bumps >= 2 * rules.recovery.max_bumps:
        return mind, (_stuck(mind),)
    if bumps % rules.recovery.max_bumps:
        return mind, ()
    match mind.search.phase:
        case Approaching(candidate) | Confirming(candidate, _):
            return reject(mind, latest(mind, candidate, rules.consensus)), (Rejected(),)
        case _ if mind.quest.pursuit is not None:
            return state.shun(mind, mind.quest.pursuit.goal), ()
        case _:
            return mind, ()


def _is_held(mind: Mind, situation: Situation, rules: Rules) -> bool:
    """Whether the robot has not got away from where it bumped too often."""
    footing = mind.footing
    return (
        footing is not None
        and footing.bumped_at is not None
        and footing.bumps >= rules.recovery.max_bumps
        and situation.pose.distance_to(footing.bumped_at.xy) < rules.recovery.bump_area_m
    )


def _stuck(mind: Mind) -> Broken:
    assert mind.footing is not None
    x, y = mind.footing.moved_at.xy
    return Broken(f"the robot is stuck at ({x:.1f}, {y:.1f})")


def _happen(mind: Mind, event: Event, senses: Senses) -> Mind:
    """The mind after the event; a new object begins with an empty quest."""
    xy = senses.pose.xy if senses.pose else None
    moment = Moment(senses.now_s, mind.attentive_s, xy, senses.odometer_m)
    if isinstance(event, Confirmed):
        claims = with_claim(mind.claims, mind.search.target, event.candidate)
        mind = replace(mind, claims=claims)
    search = transition(mind.search, event, moment)
    quest = mind.quest if search.index == mind.search.index else Quest()
    return replace(mind, search=search, quest=quest)
