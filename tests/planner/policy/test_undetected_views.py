"""What the map takes for the object counts less where the detector does not find it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from onemap_planner.motion.motions import Pose2d
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.policy.evidence import with_frame
from onemap_planner.world.map_view import WorldCells
from onemap_planner.world.regions import MISSED, UndetectedViews, discounted
from onemap_shared.geometry import F32
from tests.planner.drawn_maps import NO_POINTS, PARAMS, drawn_map, search_view_of

ROOM = ["......", "......", "......", "...###", "......", "......"]  # of 6 x 6 m, x downwards
THRESHOLD = 0.3
THING = (slice(20, 26), slice(15, 21))  # similar cells, 0.6 m square


def similarity() -> F32:
    values = np.full((60, 60), 0.1, np.float32)
    values[THING] = 0.9
    return values


def seen_from(x: float, y: float, yaw_rad: float, *, small: bool = False) -> PlanningContext:
    values = similarity()
    if small:
        values[THING] = 0.1
        values[22:24, 17:19] = 0.9
    view = search_view_of(drawn_map(*ROOM, scale=10, similarity=values))
    return build_context(
        Pose2d(x, y, yaw_rad), view, trail=(), obstacles_xy=NO_POINTS, params=PARAMS.costmap
    )


def after(*frames: PlanningContext, detected: tuple[WorldCells, ...] = ()) -> float:
    """The similarity of the thing after these frames, over that before."""
    views = UndetectedViews()
    for frame in frames:
        views = with_frame(views, frame, detected, threshold=THRESHOLD)
    last = frames[-1].map_view
    x, y = last.indices_of(frozenset({(22, 17)}))[0]
    return float(discounted(last, views).similarity[x, y] / last.similarity[x, y])


@pytest.mark.parametrize(
    ("pose", "counted"),
    [
        pytest.param((2.3, 3.8, -math.pi / 2), True, id="ahead, 2 m away"),
        pytest.param((2.3, 3.8, math.pi / 2), False, id="behind the robot"),
        pytest.param((5.5, 5.7, -math.pi * 0.63), False, id="too far for its width"),
        pytest.param((5.0, 4.0, -math.pi * 0.8), False, id="behind a wall"),
    ],
)
def test_a_view_counts_where_a_detector_would_find_it(
    pose: tuple[float, float, float], counted: bool
) -> None:
    assert after(seen_from(*pose)) == pytest.approx(MISSED if counted else 1.0)


def test_a_small_thing_must_be_nearer() -> None:
    assert after(seen_from(2.3, 3.8, -math.pi / 2, small=True)) == 1.0
    assert after(seen_from(2.3, 2.4, -math.pi / 2, small=True)) == pytest.approx(MISSED)


def test_a_detection_there_is_no_view_without_one() -> None:
    here = seen_from(2.3, 3.8, -math.pi / 2)
    assert after(here, detected=(frozenset({(21, 16)}),)) == 1.0
    assert after(here, detected=(frozenset({(2, 2)}),)) == pytest.approx(MISSED)


def test_views_from_one_place_count_once_and_those_from_others_again() -> None:
    here = seen_from(2.3, 3.8, -math.pi / 2)
    assert after(here, here, here) == pytest.approx(MISSED)
    assert after(here, seen_from(2.3, 3.5, -math.pi / 2)) == pytest.approx(MISSED**2)
    assert after(here, seen_from(2.3, 3.8, -math.pi / 2 + 0.4)) == pytest.approx(MISSED**2)


def test_other_cells_and_the_view_itself_stay_as_they_are() -> None:
    here = seen_from(2.3, 3.8, -math.pi / 2)
    views = with_frame(UndetectedViews(), here, (), threshold=THRESHOLD)
    before = here.map_view.similarity.copy()
    less = discounted(here.map_view, views).similarity
    assert np.array_equal(here.map_view.similarity, before, equal_nan=True)
    similar = np.nan_to_num(before) >= THRESHOLD
    assert np.array_equal(less[~similar], before[~similar], equal_nan=True)
    assert np.allclose(less[similar], before[similar] * MISSED)


def test_without_such_views_nothing_is_computed() -> None:
    view = seen_from(2.3, 3.8, -math.pi / 2).map_view
    assert discounted(view, UndetectedViews()) is view
