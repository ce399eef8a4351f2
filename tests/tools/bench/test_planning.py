"""The drawn building has rooms, doors and something left to explore, and steps are timed."""

from __future__ import annotations

import numpy as np

from onemap_planner.config import PlannerConfig
from onemap_planner.motion.motions import Pose2d
from onemap_planner.policy.context import build_context
from onemap_planner.world.frontiers import find_frontiers
from onemap_shared.messages import Occupancy
from onemap_tools.bench.planning import building_view, exploring, run


def test_the_building_is_connected_and_seen_in_part() -> None:
    view = building_view(20, np.random.default_rng(0))
    state, params = exploring(view), PlannerConfig()
    assert state.search.target_start.xy is not None
    context = build_context(
        Pose2d(*state.search.target_start.xy, 0.0),
        view,
        trail=(),
        obstacles_xy=np.zeros((0, 2)),
        params=params.costmap,
    )
    known = float((view.occupancy != Occupancy.UNKNOWN).mean())
    assert 0.4 < known < 0.95
    assert float(np.isfinite(context.cost_to_go.cost_m).sum()) * 0.01 > 100  # m2: many rooms
    assert len(find_frontiers(context.map_view, context.costmap)) > 10


def test_the_robot_drives_through_the_building_while_steps_are_timed() -> None:
    result = run((10,), 3)
    (row,) = result["results"]
    assert row["size_m"] == 10
    assert row["known_m2"] > 50
    assert 0 < row["cpu_p50_ms"] <= row["cpu_p95_ms"]
