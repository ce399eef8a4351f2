"""Keep-out zones: no part of the robot enters one, and one that stands inside leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.motion.motions import Drive, Pose2d
from onemap_planner.motion.velocity_controller import PathTracker, Plan
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.search.state_machine import Destination, Finished
from onemap_planner.world.costmap import BesideMap
from onemap_planner.world.frontiers import find_frontiers
from onemap_shared.geometry import F64, Velocity2d
from onemap_shared.messages import FailureCode, Place, PlaceKind, SearchKind, SearchState
from onemap_shared.places import Zones
from tests.planner.drawn_maps import PARAMS, drawn_map, places_of, search_view_of
from tests.planner.grid_world import (
    GridWorld,
    SimulatedSearch,
    in_four_rooms,
    in_one_room,
    in_two_rooms,
    start,
    start_drive,
)

RADIUS_M = PARAMS.costmap.radius_m
STEP_S = 0.05


def zone(*corners_m: tuple[float, float], name: str = "zone") -> Place:
    return Place(name, PlaceKind.KEEP_OUT, corners_m=corners_m)


def box(x0: float, y0: float, x1: float, y1: float, name: str = "zone") -> Place:
    return zone((x0, y0), (x1, y0), (x1, y1), (x0, y1), name=name)


def in_plan(world: GridWorld, place: Place) -> Place:
    """The place, given in metres from the floor plan's corner."""
    x, y = world.floor_plan.grid.bounds_m[:2]
    return replace(place, corners_m=tuple((x + a, y + b) for a, b in place.corners_m))


def distance_m(points: F64, place: Place) -> F64:
    """Metres (n,) from points (n, 2) to a polygon, negative inside; the slow twin of the masks."""
    corners = np.array(place.corners_m)
    away, inside = np.full(len(points), np.inf), np.zeros(len(points), bool)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        edge = np.array([x1 - x0, y1 - y0])
        along = np.clip((points - (x0, y0)) @ edge / max(edge @ edge, 1e-12), 0, 1)
        away = np.minimum(away, np.linalg.norm(points - (x0, y0) - along[:, None] * edge, axis=1))
        if y0 != y1:
            crossed = (y0 > points[:, 1]) != (y1 > points[:, 1])
            inside ^= crossed & (points[:, 0] < x0 + (points[:, 1] - y0) * (x1 - x0) / (y1 - y0))
    return np.where(inside, -away, away)


def reach_m(points: F64, *known: Place) -> float:
    """How far a robot at these points (n, 2) reaches into the zones at most, metres; 0: not."""
    nearest = min(float(distance_m(points, place).min()) for place in known)
    return max(RADIUS_M - nearest, 0.0)


def random_context(seed: int) -> tuple[PlanningContext, PlanningContext, Place]:
    """A robot outside of a random zone on a random map, without the zone and with it."""
    rng = np.random.default_rng(seed)
    letters = np.where(rng.random((12, 12)) < 0.12, "#", ".")
    letters[0], letters[-1], letters[:, 0], letters[:, -1] = "#", "#", "#", "#"
    view = search_view_of(drawn_map(*("".join(row) for row in letters), scale=5))
    angles = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(3, 8)))
    middle, size = rng.uniform(1.5, 4.5, 2), rng.uniform(0.3, 1.5, len(angles))
    corners = middle + size[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    place = zone(*((float(x), float(y)) for x, y in corners))
    free = view.grid.centres(np.argwhere(view.occupancy == 1))
    outside = free[distance_m(free, place) > RADIUS_M + 0.15]
    x, y = outside[rng.integers(len(outside))]
    pose = Pose2d(float(x), float(y), float(rng.uniform(-np.pi, np.pi)))
    plain = build_context(pose, view, PARAMS.costmap)
    beside = BesideMap(zones=Zones(places_of(view.grid, place)))
    return plain, build_context(pose, view, PARAMS.costmap, beside), place


@pytest.mark.parametrize("seed", range(10))
def test_no_way_and_no_command_leads_into_a_zone(seed: int) -> None:
    _, context, place = random_context(seed)
    rng, costmap = np.random.default_rng(seed), context.costmap
    ways = np.argwhere(np.isfinite(context.cost_to_go.cost_m))
    assert reach_m(costmap.grid.centres(ways), place) == 0.0
    assert costmap.keep_out is not None
    assert not costmap.passable[costmap.keep_out.closed].any()
    # Whatever is asked for, also straight into it, the commands keep the body out.
    pose, velocity = context.pose, Velocity2d()
    ends = np.array([context.pose.xy, np.mean(place.corners_m, axis=0)])
    tracker, driven = PathTracker(PARAMS.drive, STEP_S), [pose.xy]
    for step in range(120):
        if step % 40 == 20:
            end = costmap.grid.centres(ways[rng.integers(len(ways))])
            ends = np.array([pose.xy, end])
        plan = Plan("", Drive(ends, (float(ends[1, 0]), float(ends[1, 1]))), costmap, 0.0)
        velocity = tracker.velocity(plan, pose, velocity)[1].velocity
        yaw = pose.yaw_rad + velocity.angular_radps * STEP_S
        ahead = velocity.linear_mps * STEP_S
        x, y = pose.x_m + ahead * float(np.cos(yaw)), pose.y_m + ahead * float(np.sin(yaw))
        pose = Pose2d(x, y, yaw)
        driven.append(pose.xy)
    assert reach_m(np.array(driven), place) == 0.0


@pytest.mark.parametrize("seed", range(2))
def test_a_zone_hides_nothing(seed: int) -> None:
    plain, context, _ = random_context(seed)
    assert context.costmap.keep_out is not None
    for seen in ("free", "occupied", "unseen"):
        assert (getattr(context.costmap, seen) == getattr(plain.costmap, seen)).all()
    before, after = (find_frontiers(each.map_view, each.costmap) for each in (plain, context))
    assert [f.score for f in before] == [f.score for f in after]
    assert context.reachable.sum() < plain.reachable.sum()


def run(world: GridWorld, search: SimulatedSearch, *known: Place) -> SimulatedSearch:
    search.places = places_of(world.floor_plan.grid, *known)
    search.until_over(600.0)
    return search


def there_in(world: GridWorld, x: float, y: float) -> Destination:
    """A drive to (x, y), metres from the floor plan's corner."""
    ox, oy = world.floor_plan.grid.bounds_m[:2]
    return Destination(SearchKind.GO_TO, (ox + x, oy + y))


def test_what_lies_in_a_zone_is_confirmed_from_outside() -> None:
    world = in_two_rooms()
    corner = in_plan(world, box(0.1, 5.7, 2.0, 7.9, "corner"))
    over = run(world, start(world, "bed"), corner)
    assert over.state.search.results[0].outcome is SearchState.FOUND
    assert reach_m(np.array(over.trace), corner) == 0.0


def test_a_zone_in_the_way_is_named() -> None:
    world = in_two_rooms()
    room = in_plan(world, box(0.1, 4.7, 4.9, 7.9, "bedroom"))
    over = run(world, start(world, "bed"), room)
    (result,) = over.state.search.results
    assert result.reason_code is FailureCode.UNREACHABLE
    assert reach_m(np.array(over.trace), room) == 0.0
    assert "the keep-out zone 'bedroom' is in the way" in result.reason


@pytest.mark.parametrize("drawn", ["zone", "stay out"])
def test_a_drive_goes_around_a_zone_and_what_this_search_stays_out_of(drawn: str) -> None:
    world = in_one_room()
    rug = in_plan(world, box(2.6, 0.1, 3.2, 2.2, "rug"))
    search = start_drive(world, there_in(world, 4.4, 2.7))
    if drawn == "stay out":
        search.state.search = replace(search.state.search, stay_out=("Rug",))
        run(world, search, replace(rug, kind=PlaceKind.ROOM))
    else:
        run(world, search, rug)
    assert search.state.search.phase == Finished(SearchState.ARRIVED)
    assert reach_m(np.array(search.trace), rug) == 0.0


def test_a_drive_across_a_zone_without_a_way_around_fails() -> None:
    world = in_one_room()
    wall = in_plan(world, box(2.5, 0.1, 2.55, 3.9, "tape"))  # thinner than a cell
    over = run(world, start_drive(world, there_in(world, 4.4, 2.7)), wall)
    assert over.state.search.results[0].reason_code is FailureCode.UNREACHABLE
    assert "no way leads there that keeps out of 'tape'" in over.state.search.reason
    assert reach_m(np.array(over.trace), wall) == 0.0


def test_a_robot_inside_leaves_by_the_shortest_way_and_says_so() -> None:
    world = in_four_rooms()
    around = in_plan(world, box(0.0, 0.0, 1.6, 3.0, "corner"))
    search = start(world, "bed")
    for _ in range(20):
        search.step()
    search.trace.clear()
    before = distance_m(np.array([world.pose.xy]), around)[0]
    search.places = places_of(world.floor_plan.grid, around)
    search.step()
    assert "leaving the keep-out zone 'corner' first" in search.state.search.slow
    search.until_over(600.0)
    assert search.state.search.results[0].outcome is SearchState.FOUND
    away = distance_m(np.array(search.trace), around)
    assert away.min() > before - 0.02
    first_out = int(np.argmax(away >= RADIUS_M))
    way_m = np.linalg.norm(np.diff(search.trace[: first_out + 1], axis=0), axis=1).sum()
    assert way_m <= RADIUS_M - before + 0.2
    assert (away[first_out:] >= RADIUS_M - 1e-6).all()
