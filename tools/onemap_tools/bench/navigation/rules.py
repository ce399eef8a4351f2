"""The rules of a search, and how each is switched off, to see what it is good for.

A rule is what the search does beyond map, consensus, frontiers, regions and the optimal path to
the goal of the highest utility. Rules of safety are not among them: their tests hold them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from math import inf
from typing import Any
from unittest.mock import patch

import numpy as np

from onemap_planner.policy import (
    context,
    evidence,
    explore,
    goals,
    memory,
    step,
    verify,
    viewpoints,
    ways,
)
from onemap_planner.search.state_machine import Confirmed
from onemap_planner.world import frontiers, map_view, regions


@dataclass(frozen=True, slots=True)
class Rule:
    """decides: what the search does by it; off: attributes, and what they are without it."""

    decides: str
    off: tuple[tuple[Any, str, Any], ...]


def _always(value: Any) -> Callable[..., Any]:
    return lambda *_, **__: value


def _resorts_but(resort: Callable[..., Any]) -> tuple[Any, str, Any]:
    return explore, "LAST_RESORTS", tuple(r for r in explore.LAST_RESORTS if r is not resort)


def _known_borders(*given: Any) -> Any:
    return tuple(each for each in frontiers.find_frontiers(*given) if each.unknown)


def _room_everywhere(_map: Any, _wanted: Any, places: Any, _range_m: float) -> Any:
    return np.full(len(places), frontiers.VIEW_SCALE_M2)


RULES = {
    "hysteresis": Rule("another goal must be better by a part", ((goals, "HYSTERESIS", 0.0),)),
    "hint": Rule(
        "what is near a frontier tells of what is behind it", ((frontiers, "HINT_WEIGHT", 0.0),)
    ),
    "area": Rule(
        "more unknown space in view is worth more", ((frontiers, "area_in_view", _room_everywhere),)
    ),
    "unexplored": Rule(
        "what was seen badly has frontiers too", ((explore, "find_frontiers", _known_borders),)
    ),
    "scores": Rule(
        "without labels goals go by the score too",
        ((map_view.MapView, "promise", property(lambda view: view.similarity)),),
    ),
    "missed": Rule("what shows no detection in view counts less", ((regions, "MISSED", 1.0),)),
    "first_look": Rule("the robot looks around first", ((step, "KNOWN_AROUND", 0.0),)),
    "turns": Rule(
        "time spent on goals that take turns counts",
        ((memory.TargetMemory, "leave", _always(None)),),
    ),
    "disputed": Rule(
        "detections without the map's support are weighed",
        ((evidence, "_disputed", _always(())),),
    ),
    "contradictions": Rule(
        "detections of other names count against it",
        ((evidence, "count_contradictions", lambda candidates, *_, **__: candidates),),
    ),
    "more_looks": Rule(
        "what was not confirmed is viewed from other sides",
        tuple((module, "MAX_LOOKS", 1) for module in (memory, verify, evidence)),
    ),
    "nearer": Rule(
        "the robot goes nearer where its edge is farther than it seemed",
        ((verify, "_sure", lambda _memory, candidate, _context: Confirmed(candidate)),),
    ),
    "dead_ends": Rule(
        "what was given up is tried again after a change there",
        tuple((module, "DEAD_END_RETURNS", 0) for module in (memory, verify)),
    ),
    "unreached": Rule("the way to what has no viewpoint is sought", ((ways, "MAX_UNREACHED", 0),)),
    "floor_before": Rule(
        "a viewpoint is on the floor before the thing",
        ((viewpoints, "_before", lambda _target, _away, _free, stand: stand),),
    ),
    "way_not_known": Rule(
        "what was seen over unknown floor has no viewpoint",
        ((viewpoints, "_unknown_before", _always(False)),),
    ),
    "height": Rule(
        "low things are viewed from farther away",
        ((context.Bands, "at", lambda bands, _height_m: bands.distances_m),),
    ),
    "seen_side": Rule(
        "a thing is in sight from the side it was seen from",
        ((viewpoints, "seen_from_side", _always(False)),),
    ),
    "least_occluded": Rule(
        "what is hidden from everywhere is viewed all the same",
        tuple((module, "least_occluded", _always(None)) for module in (viewpoints, goals)),
    ),
    "closed_ways": Rule("what closes a way is viewed", ((ways, "LEAST_CLOSED_M2", inf),)),
    "cut_off": Rule(
        "a way to floor that is cut off is looked for", ((explore, "LEAST_CUT_OFF_M2", inf),)
    ),
    "last_regions": Rule("in the end: what is a little like it", ((regions, "LAST_LOOKS", 0),)),
    "last_turn": Rule("in the end: a turn", (_resorts_but(explore.look_around),)),
    "gaps": Rule(
        "in the end: ways across narrow unknown gaps",
        (_resorts_but(explore.cross_gaps), (explore, "lies_across_gap", _always(False))),
    ),
    "reconsider": Rule(
        "in the end: once more what was rejected", (_resorts_but(explore.reconsider),)
    ),
}


@contextmanager
def without(names: Iterable[str]) -> Iterator[None]:
    """Switch the rules of these names off."""
    with ExitStack() as stack:
        for name in names:
            for where, attribute, value in RULES[name].off:
                stack.enter_context(patch.object(where, attribute, value))
        yield
