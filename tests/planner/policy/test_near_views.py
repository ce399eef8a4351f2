"""A frame counts for a candidate that it could have shown from near."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.motion.motions import Pose2d
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.policy.evidence import map_rank, object_probability, with_near_view
from onemap_planner.world.candidates import ObjectCandidate
from tests.planner.drawn_maps import NO_POINTS, PARAMS, drawn_map, search_view_of
from tests.planner.one_room import candidate, context

WALLED = search_view_of(drawn_map(*["......#......"] * 4, scale=5))


def seen_from(x: float, y: float, yaw_rad: float) -> ObjectCandidate:
    """A candidate behind the wall at y = 3 to 3.5 m, after one frame from this pose."""
    here = build_context(
        Pose2d(x, y, yaw_rad), WALLED, trail=(), obstacles_xy=NO_POINTS, params=PARAMS.costmap
    )
    thing = replace(candidate(1.0, 4.0), seen_from=((1.0, 5.0),))
    return with_near_view(thing, here, hit=True, near_m=1.5)


@pytest.mark.parametrize(
    ("pose", "counted"),
    [
        pytest.param((1.0, 5.0, -math.pi / 2), True, id="near and ahead"),
        pytest.param((1.0, 5.0, math.pi / 2), False, id="behind the robot"),
        pytest.param((1.0, 6.0, -math.pi / 2), False, id="2 m away"),
        pytest.param((1.0, 2.7, math.pi / 2), False, id="behind the wall"),
        pytest.param((1.0, 0.5, math.pi / 2), False, id="far away"),
    ],
)
def test_near_views_are_counted(pose: tuple[float, float, float], counted: bool) -> None:
    after = seen_from(*pose)
    assert after.near_frames == int(counted)
    assert sum(tally.hits for tally in after.near_views) == int(counted)


def test_a_candidate_outside_the_map_has_no_views() -> None:
    outside = replace(candidate(1.5, 1.0), cells=frozenset({(900, 900)}))
    assert with_near_view(outside, context(), hit=True, near_m=1.5) == outside


def with_layers(*, guidance: float, margin: float) -> PlanningContext:
    plain = context()
    view = plain.map_view
    return replace(
        plain,
        map_view=replace(
            view,
            guidance=np.full_like(view.guidance, guidance),
            margin=np.full_like(view.margin, margin),
        ),
    )


@pytest.mark.parametrize(
    ("guidance", "margin", "rank"),
    [
        pytest.param(0.9, np.inf, 0.9, id="no other name"),
        pytest.param(0.9, -0.2, 0.9, id="another name is a little more similar"),
        pytest.param(0.9, -0.6, 0.0, id="the map says that it is the other"),
    ],
)
def test_the_rank_of_a_candidate(guidance: float, margin: float, rank: float) -> None:
    there = with_layers(guidance=guidance, margin=margin)
    assert map_rank(candidate(2.0, 2.0), there) == pytest.approx(rank)


def test_where_the_map_knows_nothing_it_is_not_the_object() -> None:
    unknown = with_layers(guidance=np.nan, margin=np.inf)
    assert object_probability(candidate(2.0, 2.0), unknown) == 0.0
