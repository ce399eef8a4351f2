"""Approaching and confirming: walk up to a candidate and make sure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_planner.motion.pure_pursuit import Drive, Motion, Rest, arrived
from onemap_planner.policy.context import Situation
from onemap_planner.policy.params import ExploreRules, Rules
from onemap_planner.policy.state import Mind
from onemap_planner.policy.viewpoints import least_hidden_stand, seeing_stand, stands_around
from onemap_planner.search.phases import (
    Approaching,
    Arrived,
    Confirmed,
    Confirming,
    Event,
    Rejected,
)
from onemap_planner.world.candidates import Candidate, ConsensusRules
from onemap_planner.world.costmap import Terrain
from onemap_shared.geometry import I64


def find_stand(
    candidate: Candidate, situation: Situation, rules: ExploreRules
) -> tuple[float, float] | None:
    """Where (metres) to stand before the candidate; None if nowhere can be reached."""
    cells = situation.cells_of(candidate.surface)
    if len(cells) == 0:
        return None
    terrain, reach = situation.terrain, situation.reach
    cells = _solid(cells, terrain)
    seen_from = terrain.grid.cells(np.asarray(candidate.seen_from))
    stand = None
    for farthest_m in (rules.approach_farthest_m, rules.approach_last_resort_m):
        band_m = (rules.approach_nearest_m, farthest_m)
        around = stands_around(cells, terrain, reach, band_m=band_m, tried=cells[:0])
        stand = seeing_stand(around, seen_from)
        if stand is not None:
            break
    else:
        stand = least_hidden_stand(around)
    if stand is None:
        return None
    x, y = terrain.grid.centres(stand)
    return float(x), float(y)


def _solid(cells: I64, terrain: Terrain) -> I64:
    """The cells (K, 2) in which something stands, all of them if none does.

    A detection's rim covers floor before the thing; it must not be taken for its surface.
    """
    solid = cells[terrain.occupied[cells[:, 0], cells[:, 1]]]
    return solid if len(solid) else cells


def approach(
    mind: Mind, phase: Approaching, situation: Situation, rules: Rules
) -> tuple[Mind, Motion, Event | None]:
    """Walk up to the candidate, which later sightings may move."""
    candidate = latest(mind, phase.candidate, rules.consensus)
    stand_xy = find_stand(candidate, situation, rules.explore)
    if stand_xy is None:
        return _wait_for_way(mind, candidate, rules)
    mind = replace(mind, quest=replace(mind.quest, idle_since_s=None))
    look_xy = (candidate.xyz[0], candidate.xyz[1])
    motion = situation.drive_to(stand_xy, look_xy)
    if arrived(motion, situation.pose, rules.drive):
        return mind, motion, Arrived(candidate)
    return mind, motion, None


def confirm(
    mind: Mind, phase: Confirming, situation: Situation, rules: Rules
) -> tuple[Mind, Motion, Event | None]:
    """Stand still, face the candidate and count the detections that agree."""
    candidate = latest(mind, phase.candidate, rules.consensus)
    motion = Drive(np.array([situation.pose.xy]), (candidate.xyz[0], candidate.xyz[1]))
    agreeing = candidate.sightings - phase.candidate.sightings
    against = candidate.against - phase.candidate.against
    if agreeing >= rules.explore.confirm_sightings and agreeing > against:
        return mind, Rest(), Confirmed(candidate)
    if mind.attentive_s - phase.since_s > rules.explore.confirm_s:
        return reject(mind, candidate), Rest(), Rejected()
    return mind, motion, None


def latest(mind: Mind, candidate: Candidate, rules: ConsensusRules) -> Candidate:
    """What has become of the candidate: the remembered one at the same place."""
    for known in mind.quest.candidates:
        if not known.cells.isdisjoint(candidate.cells):
            return known
    near = [c for c in mind.quest.candidates if c.distance_m(candidate.xyz) <= rules.merge_m]
    return near[0] if near else candidate


def reject(mind: Mind, candidate: Candidate) -> Mind:
    """The mind that no longer believes in the candidate, nor in new sightings of it."""
    quest = mind.quest
    left = tuple(c for c in quest.candidates if c.cells.isdisjoint(candidate.cells))
    return replace(
        mind,
        quest=replace(
            quest, candidates=left, rejected=(*quest.rejected, candidate), idle_since_s=None
        ),
    )


def _wait_for_way(
    mind: Mind, candidate: Candidate, rules: Rules
) -> tuple[Mind, Motion, Event | None]:
    """The map may have hidden the way for a moment only."""
    since_s = mind.quest.idle_since_s
    if since_s is None:
        since_s = mind.attentive_s
    if mind.attentive_s - since_s > rules.explore.settle_s:
        return reject(mind, candidate), Rest(), Rejected()
    return replace(mind, quest=replace(mind.quest, idle_since_s=since_s)), Rest(), None
