"""Sentences about what the robot does and why, for people who see neither its map nor its numbers.

They are made here alone: page, command line, HTTP, agents and records show them as they are. The
numbers stand beside them in the messages.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from enum import Enum
from math import atan2, degrees, dist, pi, remainder

from onemap_shared.messages import ObjectResult, SearchState
from onemap_shared.names import definite, with_article

NEAR_M = 1.5  # from a thing, a place is near it: the distance from which a thing counts as found
HERE_M = 0.75  # nearer, a distance rounds to no whole metre worth naming
BEHIND_M = 0.5  # by which a thing is nearer to the robot than what lies behind it
BEHIND_DEG = 20.0  # between the directions to both: a sofa's half width at 3 m
AHEAD_DEG = 20.0  # from the robot's heading: ahead
ASIDE_DEG = 60.0  # up to here ahead and to a side, beyond to that side
BACK_DEG = 120.0  # beyond, behind the robot

Xy = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Landmarks:
    """By what a place is described: the robot's place (metres) and heading, and named things."""

    xy: Xy
    yaw_rad: float
    things: tuple[tuple[str, Xy], ...] = ()

    def where(self, xy: Xy) -> str:
        """A point (metres) in words: "behind the sofa", or "3 m ahead to the left"."""
        away_m, towards_deg = dist(self.xy, xy), self._bearing_deg(xy)
        near = [(dist(xy, at), name, at) for name, at in self.things if dist(xy, at) <= NEAR_M]
        if near:
            _, name, at = min(near)
            nearer = away_m - dist(self.xy, at) >= BEHIND_M
            between = abs(remainder(towards_deg - self._bearing_deg(at), 360.0)) <= BEHIND_DEG
            return f"{'behind' if nearer and between else 'near'} {definite(name)}"
        if away_m < HERE_M:
            return "next to the robot"
        side = "left" if towards_deg > 0 else "right"
        turned_deg = abs(towards_deg)
        if turned_deg <= AHEAD_DEG:
            direction = "ahead"
        elif turned_deg <= ASIDE_DEG:
            direction = f"ahead to the {side}"
        elif turned_deg <= BACK_DEG:
            direction = f"to the {side}"
        else:
            direction = "behind the robot"
        return f"{away_m:.0f} m {direction}"

    def _bearing_deg(self, xy: Xy) -> float:
        """Direction of a point from the robot's heading, -180 to 180, positive to the left."""
        towards_rad = atan2(xy[1] - self.xy[1], xy[0] - self.xy[0])
        return degrees(remainder(towards_rad - self.yaw_rad, 2 * pi))


# What the robot does, of a goal; {where} it is, and the thing that is sought as {a}.
UNEXPLORED = "going to the unexplored space {where}"
AFAR = "going to a place {where} that was only seen from afar"
ALIKE = "going to the place {where}"
SEEN = "going for a closer look at what may be {a} {where}"
DOUBTED = "going for a closer look at what the camera took for {a} {where}"
OBSTACLE = "going to look at what blocks the only way to the floor behind it, {where}"
WALLS = "going to see the walls {where}, which tell what room {a} is in"
ONWARD = "going to the unexplored space {where}, on the way to what looks like {a}"


class Gain(Enum):
    """What speaks for a goal: if no other has more of it, and against the next best one."""

    LIKENESS = ("looks most like {a}", "looks more like {a}")
    PROMISE = ("promises most", "promises more")
    WAY = ("is the nearest", "is nearer")


MAX_GAINS = 2  # named of one goal, the weightiest
ONLY = "it is the only place left to look at"
KEPT = "the robot is on its way there, and no other place is much better"


def goal_sentence(doing: str, where: str, name: str, why: str = "") -> str:
    """What the robot does, as with ``doing`` above, and why; name: of what is sought."""
    told = f"{doing}: {why}" if why else doing
    return told.replace("{where}", where).replace("{a}", with_article(name) if name else "it")


def gained(gains: Sequence[tuple[Gain, bool]], *, like: bool) -> str:
    """Why a goal won; with each gain, the weightiest first, whether no other goal has more of it.

    like: it is where the map looks like the object.
    """
    named = gains[:MAX_GAINS]
    most = [gain.value[0] for gain, best in named if best]
    more = [gain.value[1] for gain, best in named if not best]
    parts = [*most, *more]
    if like and all(gain is not Gain.LIKENESS for gain, _ in named):
        parts.insert(0, "looks like {a}")
    if not parts:
        return "no other place is better"
    return f"it {' and '.join(parts)}{' than the next best place' if more else ''}"


def approaching(name: str, sightings: int, where: str = "") -> str:
    """That the robot walks up to what it takes for the object, and why."""
    there = f" {where}" if where else ""
    often = {1: "once", 2: "twice"}.get(sightings, f"{sightings} times")
    return (
        f"walking up to what looks like {with_article(name)}{there}: the camera saw it {often} "
        "and the map agrees"
    )


def driving(place: str, *, look: bool, where: str = "") -> str:
    """That the robot drives to a place, or to where it can be seen."""
    there = f", {where}" if where else ""
    return f"going to where {place} can be seen{there}" if look else f"driving to {place}{there}"


RETURNING = "going back to where it set out"
RETURNED = "back where it set out"
START_LOST = (
    "since then the robot's position jumped or the map was replaced, and its coordinates may be "
    "another place now"
)


def not_returned(why: str) -> str:
    """That the robot did not get back to where it set out."""
    return f"it did not get back to where it set out: {why}"


def onward(place: str) -> str:
    """That the robot explores on the way to a place."""
    return f"{UNEXPLORED}, on the way to {place}"


MAP_ANEW = "the map began anew: "
MAP_REPLACED = (
    "the map was replaced, and these coordinates may be another place now: say again where to drive"
)
MOVED = "it was moved, or its position was wrong: "


def asking(name: str) -> str:
    """That the search for an object, or the drive to a place, begins."""
    return f"asking the map about {definite(name)}"


def looking_around(name: str) -> str:
    """That the robot turns on the spot, before it sets out; name: what it looks for, or empty."""
    return f"looking around for {with_article(name)}" if name else "looking around"


def looking_for(name: str) -> str:
    """That the robot explores, without a goal yet."""
    return f"looking for {with_article(name)}"


def confirming(name: str) -> str:
    """That the robot stands before what it takes for the object."""
    return f"standing in front of it, making sure that it is {with_article(name)}"


class Agreement(str, Enum):
    """How far the map agrees with a detector, in words."""

    MAP = "and the map agrees"
    SAME_FEATURES = "and the map agrees, by the same encoder: one opinion, not two"
    DETECTOR = "though the map does not agree"


def confirmed(
    sightings: int, agreement: Agreement, name: str = "", checks: Sequence[str] = ()
) -> str:
    """That the object was found, and which parts of its description hold, if there is one."""
    seen = f"seen in {sightings} images from near, {agreement.value}"
    return f"{with_article(name)}, {'; '.join(checks)}; {seen}" if checks else seen


def found_other(name: str, wrong: Sequence[str]) -> str:
    """That another object of the name was found: which parts of the description do not hold."""
    return f"found {with_article(name)}, but {', '.join(wrong)}"


def not_navigable(xy: Xy) -> str:
    """That the robot's own navigation does not get to a place (metres)."""
    return f"the robot's own navigation found no way to ({xy[0]:.1f}, {xy[1]:.1f})"


def seen_out_of_reach(xy: Xy, sightings: int) -> str:
    """That an object was detected at a place (metres), and the robot found no way to it."""
    images = "one image" if sightings == 1 else f"{sightings} images"
    return f"; seen in {images} at ({xy[0]:.1f}, {xy[1]:.1f}), but no way to it was found"


MAX_LEFT_ASIDE = 5  # named at the end of a search


def left_aside(things: Sequence[tuple[Xy, str]]) -> str:
    """What a search left aside, each with its place (metres) and the reason; empty: nothing.

    Those of one reason are named together, in the order in which they come.
    """
    places: dict[str, list[str]] = {}
    for (x, y), why in things[:MAX_LEFT_ASIDE]:
        places.setdefault(why, []).append(f"({x:.1f}, {y:.1f})")
    named = [f"at {' and '.join(at)} ({why})" for why, at in places.items()]
    if len(things) > MAX_LEFT_ASIDE:
        named.append(f"{len(things) - MAX_LEFT_ASIDE} more")
    return f"; left aside: {', '.join(named)}" if named else ""


# Why the robot leaves a thing aside.
NOT_CONFIRMED = "the camera did not confirm it from near"
NO_WAY_TO = "no way leads to it"
STUCK_ON_WAY = "the robot got stuck on the way to it"


CREEPS_CLOSE_BY = "driving slowly, because obstacles are near"


def creeps_unseen(floor_m: float) -> str:
    """That the robot creeps over floor that its camera has not seen, and what helps.

    floor_m: from where on the camera shows floor, metres; infinity: it shows none.
    """
    sees = "no floor" if floor_m == float("inf") else f"the floor only from {floor_m:.1f} m on"
    return (
        f"driving slowly over floor that the camera has not seen: it sees {sees}; "
        "tilt it down or mount it lower"
    )


def pose_jumped(what: str, by: str) -> str:
    """That the robot stands, because its position or heading changed by more than it can drive."""
    return f"standing still: its {what} jumped by {by}; was the robot pushed or carried?"


def beside_map(by_m: float) -> str:
    """That the robot stands, because what it sees is elsewhere on the map."""
    where = f"{by_m:.1f} m away from where the map shows it"
    return f"standing still: what the camera sees is {where}; was the robot pushed?"


def leaving_zone(name: str, *, known: bool) -> str:
    """That the robot leaves the keep-out zone that it stands in; known: it has a way out."""
    if known:
        return f"leaving the keep-out zone {name!r} first, by the shortest way"
    return f"it stands in the keep-out zone {name!r}, and no way out of it is known"


def no_place(name: str, known: Sequence[str]) -> str:
    """That the map has no place of this name, and which ones it has."""
    which = f"there are {', '.join(map(repr, known))}" if known else "no place has a name"
    return f"there is no place {name!r} on the map; {which}"


NO_WAY_BACK = (
    "it is not known where the robot stood when the last search began: there was none, or since "
    "then the robot's position jumped, or the planner, the driver or the map was replaced"
)


def zone_in_the_way(name: str) -> str:
    """Why the robot cannot go there."""
    return f"the keep-out zone {name!r} is in the way"


def no_way(zones: Sequence[str]) -> str:
    """Why the robot cannot go there, which keeps out of these zones."""
    kept = f" that keeps out of {', '.join(map(repr, zones))}" if zones else ""
    return f"no way leads there{kept}"


def outside(place: str, by_m: float, bounds_m: tuple[float, float, float, float]) -> str:
    """Why the robot does not set out: the place is that far outside of the map (x_min, y_min,
    x_max, y_max), all in metres."""
    x_min, y_min, x_max, y_max = bounds_m
    return (
        f"{place} is {by_m:.0f} m outside of the map, which reaches from x {x_min:.0f} to "
        f"{x_max:.0f} m and from y {y_min:.0f} to {y_max:.0f} m: correct the place, or explore "
        "nearer to it first"
    )


PLANNER_STOPPED = "the planner was stopped"
PLANNER_ENDED = "the planner ended before the search did"
DRIVER_CHANGED = "the robot's driver was restarted, or another one drives the robot"


def interrupted(why: str, at_ns: int, results: Iterable[ObjectResult]) -> str:
    """Why and when, in nanoseconds since 1970, a search was interrupted, and what was found."""
    at = datetime.fromtimestamp(at_ns / 1e9, tz=timezone.utc)
    found = [each.name for each in results if each.outcome is SearchState.FOUND]
    what = f"; found before: {', '.join(found)}" if found else ""
    return f"interrupted at {at:%Y-%m-%d %H:%M:%S} UTC: {why}{what}"


CLOCK_SET_S = 5.0  # links and encoders are rarely that late: a clock may be the reason


def waiting_for(what: str, how: str) -> str:
    """Why the robot waits."""
    return f"waiting for {what}: {how}"


def late(what: str, age_s: float) -> str:
    """That something has not come for so many seconds; infinity: never."""
    return waiting_for(what, "none yet" if age_s == float("inf") else f"none for {age_s:.1f} s")


def behind(what: str, lag_s: float) -> str:
    """That something comes this many seconds late, or that a clock was set."""
    set_forward = ", or the robot's clock was set" if lag_s > CLOCK_SET_S else ""
    return waiting_for(what, f"{lag_s:.1f} s behind{set_forward}")


def ahead(what: str, ahead_s: float) -> str:
    """That something is stamped later than the robot's position: a clock was set back."""
    how = f"its stamps are {ahead_s:.1f} s ahead of the robot's position: was a clock set?"
    return waiting_for(what, how)
