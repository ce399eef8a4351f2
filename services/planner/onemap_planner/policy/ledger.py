"""Ledger of what a search has tried, so that it tries something else, or the same from elsewhere.

An option that was tried in vain is not offered again, until obstacles come or go around it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import dist

import numpy as np

from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import GIVEN_UP_RADIUS_M, Goal, GoalKind
from onemap_planner.policy.viewpoints import find_viewpoint
from onemap_planner.world.candidates import MERGE_M, ObjectCandidate
from onemap_planner.world.map_view import MapView
from onemap_shared.geometry import F64, U8
from onemap_shared.messages import Occupancy

MAX_LOOKS = 3  # views of one region or uncertain candidate, from different viewpoints
MAX_VISITS = 2  # of a place whose floor is not seen: then no way leads there
AROUND_M = 1.0  # metres around a place, on all sides, in which changes count: a door
# Square metres that have become free or occupied: half a person; noise at the rims of furniture
# changes less.
CHANGED_M2 = 0.3
# How often one place is offered again in a search: people who walk through a room change it all the
# time.
MAX_RETURNS = 2

Xy = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Attempt:
    """What was tried: a place xy, from a viewpoint from_xy, metres.

    around: the occupancy uint8 of its surroundings then, row by row; empty until the next view of
    the map. offered: whether it was offered again since.
    """

    kind: GoalKind
    xy: Xy
    from_xy: Xy
    around: bytes = b""
    offered: bool = False

    def is_near(self, xy: Xy, within_m: float) -> bool:
        """Whether its place is within ``within_m`` of another one, metres."""
        return dist(self.xy, xy) <= within_m


@dataclass(slots=True)
class Ledger:
    """The attempts of a search, in their order.

    Those at frontiers count for all its objects: what could not be seen for one cannot for the
    next.
    """

    attempts: tuple[Attempt, ...] = ()

    def forget_looks(self) -> None:
        """Forget what was tried for one object only: looks at regions and candidates."""
        self.attempts = tuple(e for e in self.attempts if e.offered or e.kind is GoalKind.FRONTIER)

    def give_up(self, goal: Goal) -> None:
        """A goal was given up, when the robot had been there or on its way."""
        self._add(Attempt(goal.kind, goal.look_xy, goal.viewpoint_xy))

    def looked_in_vain(self, candidate: ObjectCandidate, from_xy: Xy) -> None:
        """A candidate could not be confirmed from a place, metres: seen from there in vain, or
        where the robot got stuck on the way to a viewpoint."""
        self._add(Attempt(GoalKind.DETECTION, candidate.xyz[:2], from_xy))

    def is_given_up(self, goal: Goal) -> bool:
        """Whether enough goals of its kind were given up near it.

        One visit decides about a frontier; an object may be visible from another viewpoint.
        """
        tries = sum(e.is_near(goal.look_xy, GIVEN_UP_RADIUS_M) for e in self._tried(goal.kind))
        return tries >= (1 if goal.kind is GoalKind.FRONTIER else MAX_LOOKS)

    def tried_xy(self, kind: GoalKind) -> F64:
        """Viewpoints (T, 2), metres, of the goals of this kind that were given up."""
        return np.array([e.from_xy for e in self._tried(kind)], np.float64).reshape(-1, 2)

    def given_up_xy(self, kind: GoalKind) -> F64:
        """Places (L, 2), metres, of the goals of this kind that were given up, once each time."""
        return np.array([e.xy for e in self._tried(kind)], np.float64).reshape(-1, 2)

    @property
    def looked_xy(self) -> F64:
        """Those of the frontiers, metres."""
        return self.given_up_xy(GoalKind.FRONTIER)

    @property
    def closed_xy(self) -> F64:
        """Those of them that were given up ``MAX_VISITS`` times."""
        places = self.looked_xy
        away_m = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
        often: F64 = places[(away_m <= GIVEN_UP_RADIUS_M).sum(axis=1) >= MAX_VISITS]
        return often

    def looked_from(self, xy: Xy) -> list[Xy]:
        """Places, metres, from which a candidate at this one was looked at in vain."""
        return [e.from_xy for e in self._tried(GoalKind.DETECTION) if e.is_near(xy, MERGE_M)]

    def next_viewpoint(self, candidate: ObjectCandidate, context: PlanningContext) -> Xy | None:
        """The viewpoint (metres) of a candidate that was not tried; None if none can be reached."""
        looked_from = self.looked_from(candidate.xyz[:2])
        return find_viewpoint(candidate, context, [*candidate.exhausted_viewpoints, *looked_from])

    def offer_changed(self, map_view: MapView) -> None:
        """Offer again what was given up, where obstacles came or went around it since.

        What was in the way may have been a person, a chair or a closed door. Unknown floor that
        becomes known is no such change: then the border lies elsewhere and is another goal.
        """
        before = [each for each in self.attempts if each.offered]

        def now(each: Attempt) -> Attempt:
            if each.offered:
                return each
            if not each.around:
                return replace(each, around=surroundings(map_view, each.xy).tobytes())
            returns = sum(other.is_near(each.xy, AROUND_M) for other in before)
            return replace(each, offered=returns < MAX_RETURNS and _changed(each, map_view))

        self.attempts = tuple(now(each) for each in self.attempts)

    def _tried(self, kind: GoalKind) -> list[Attempt]:
        """The attempts of a kind that are not offered again."""
        return [each for each in self.attempts if each.kind is kind and not each.offered]

    def _add(self, attempt: Attempt) -> None:
        self.attempts = (*self.attempts, attempt)


def surroundings(map_view: MapView, xy: Xy) -> U8:
    """Occupancy (n, n) uint8 of the square around a place; unknown outside of the view."""
    reach = int(AROUND_M / map_view.grid.cell_size_m)
    patch = np.full((2 * reach + 1, 2 * reach + 1), Occupancy.UNKNOWN, np.uint8)
    first = map_view.grid.cells(np.asarray(xy)) - reach
    lower = np.clip(first, 0, map_view.grid.shape)
    upper = np.clip(first + len(patch), 0, map_view.grid.shape)
    (x0, y0), (x1, y1) = lower, upper
    a, b = lower - first
    patch[a : a + x1 - x0, b : b + y1 - y0] = map_view.occupancy[x0:x1, y0:y1]
    return patch


def _changed(attempt: Attempt, map_view: MapView) -> bool:
    now = surroundings(map_view, attempt.xy)
    then = np.frombuffer(attempt.around, np.uint8).reshape(now.shape)
    both_known = (now != Occupancy.UNKNOWN) & (then != Occupancy.UNKNOWN)
    area_m2 = float((both_known & (now != then)).sum()) * map_view.cell_area_m2
    return area_m2 >= CHANGED_M2
