"""The methods' switches, the baselines' exploration and VLFM's value map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_perception.config import SHIPPED
from onemap_perception.text.vocabulary import load_table
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.policy.state import PlannerState
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_shared.messages import Detections, FeatureField, TextEmbeddings
from onemap_tools.bench.navigation import methods
from tests.planner.drawn_maps import PARAMS, drawn_map, search_view_of
from tests.planner.one_room import POSE, SEARCH, explored


def seen(*rows: str) -> PlanningContext:
    view = search_view_of(drawn_map(*rows, scale=5))
    return build_context(POSE, view, PARAMS.costmap)


BOTH_ENDS = seen(*["   .........      "] * 10)


QUERY = TextEmbeddings(
    "e",
    "s",
    ("bed",),
    np.array([[1.0, 0.0]], np.float32),
    np.zeros((0, 2), np.float32),
    np.zeros((1, 0), np.uint8),
    1.0,
)


NO_POINTS_3D = np.zeros((0, 3), np.float32)
NOTHING = Detections(
    *(1, 1, "d", (), np.zeros((0, 4), np.float32), np.zeros(0, np.float32)),
    *(NO_POINTS_3D, np.zeros(0, np.int32)),
)


def field(feature: tuple[float, ...], yaw_rad: float = 0.0, depth_mm: int = 4000) -> FeatureField:
    """A level camera at (0, 0) that sees a wall everywhere."""
    return FeatureField(
        sequence=1,
        stamp_ns=1,
        encoder_id="e",
        text_space="s",
        features=np.full((3, 4, len(feature)), feature, np.float16),
        variance=np.ones((30, 40), np.float32),
        depth_mm=np.full((30, 40), depth_mm, np.uint16),
        intrinsics=Intrinsics.from_fov(40, 30, np.pi / 2),
        T_map_camera=pose_2d(0.0, 0.0, yaw_rad) @ camera_mount(0.0, 1.0, 0.0),
    )


OF_WORDS = load_table(SHIPPED)


def words(*names: str) -> TextEmbeddings:
    rows, mask = OF_WORDS.embed(names), np.zeros((len(names), 0), np.uint8)
    return replace(QUERY, texts=names, embeddings=rows, neutral_mask=mask, neutral=rows[:0])


def frontier(company: methods.CompanyMap) -> tuple[float, float]:
    """Where a robot drives first that ranks frontiers so."""
    ranked = methods.FrontierExploration(company.rank, margin=0.0)
    state, *_ = explored(PlannerState(SEARCH), BOTH_ENDS, ranked)
    assert state.active_goal is not None
    return state.active_goal.goal.look_xy


@pytest.mark.parametrize(("sought", "beside"), [("refrigerator", 1), ("pillow", 0)])
def test_the_frontier_near_what_the_object_keeps_company_with_is_chosen(
    sought: str, beside: int
) -> None:
    company, places = methods.CompanyMap(0.1), np.array([[0.8, 3.7, 0], [4.3, 3.7, 0]], np.float32)
    near_m, nearest = 1.6, frontier(company)
    assert {"bed", "oven", "kitchen"} < set(company.names)
    seen = replace(
        NOTHING,
        names=("bed", "oven"),
        boxes_px=np.zeros((2, 4), np.float32),
        scores=np.ones(2, np.float32),
        points_map=places,
        point_owner=np.arange(2, dtype=np.int32),
    )
    queries = words(sought, "bed", "oven", "chair", "bedroom", "kitchen")
    elsewhere = field(tuple(queries.embeddings[4]), yaw_rad=np.pi)
    for _ in range(methods.COMPANY_SIGHTINGS):
        assert frontier(company) == nearest
        company.add(elsewhere, queries, seen)
    chosen = frontier(company)
    assert np.linalg.norm(chosen - places[beside, :2]) <= near_m
    company.clear()
    assert frontier(company) == nearest
