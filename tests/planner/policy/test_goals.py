"""The goal of the highest utility is selected; the current one is kept within hysteresis."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_planner.policy import goals as goals_module
from onemap_planner.policy.choose import choose
from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility, frontier_goals, successor
from onemap_planner.world.frontiers import find_frontiers
from tests.planner.drawn_maps import drawn_map
from tests.planner.one_room import standing
from tests.reference.planning import nearest_of


def goal(total: float, x: float = 0.0, kind: GoalKind = GoalKind.FRONTIER) -> Goal:
    return Goal(kind, (x, 0.0), (x, 0.0), GoalUtility(total, 0.0), "")


def test_the_current_goal_is_kept_unless_another_is_clearly_better() -> None:
    current = goal(0.3, 1.0)
    today = goal(0.3, 1.2)
    assert choose([today, goal(0.38, 5.0)], current) == today
    assert choose([today, goal(0.45, 5.0)], current) == goal(0.45, 5.0)
    assert choose([goal(0.1, 5.0)], current) == goal(0.1, 5.0)  # it is gone


@given(st.floats(0.1, 10.0), st.lists(st.tuples(st.floats(0.01, 1), st.floats(0, 30)), min_size=2))
def test_the_choice_does_not_depend_on_the_scale_of_the_scores(
    scale: float, values: list[tuple[float, float]]
) -> None:
    """An encoder without calibration has scores of another size."""

    def chosen(factor: float) -> Goal | None:
        goals = [
            replace(goal(0.0, float(i)), utility=GoalUtility(factor * s, way_m))
            for i, (s, way_m) in enumerate(values)
        ]
        return choose(goals, None)

    plain, scaled = chosen(1.0), chosen(scale)
    assert plain is not None
    assert scaled is not None
    assert scaled.utility.total == pytest.approx(scale * plain.utility.total)


def border(y: int, x0: int, x1: int, total: float = 0.3, look_x: float = 0.0) -> Goal:
    """A goal at a border along x, in cells."""
    cells = frozenset((x, y) for x in range(x0, x1))
    return replace(goal(total, look_x), cells=cells)


def test_a_border_is_recognised_by_its_cells_though_its_middle_jumps() -> None:
    earlier = border(10, 0, 25, look_x=1.25)
    rest = border(11, 18, 25, look_x=2.15)  # most of it was seen
    other = border(14, 0, 8, total=0.35, look_x=1.0)  # nearer to the middle it had
    assert successor([other, rest], earlier) == rest
    assert choose([other, rest], earlier) == rest


def test_a_goal_of_another_kind_or_elsewhere_is_another() -> None:
    earlier = border(10, 0, 20, look_x=1.0)
    region = replace(earlier, kind=GoalKind.REGION)
    assert successor([region, border(10, 40, 50, look_x=4.5)], earlier) is None
    jumped = border(16, 0, 20, look_x=1.2)  # beyond its growth, but at the same place
    assert successor([jumped], earlier) == jumped


@settings(deadline=None, max_examples=40)
@given(arrays(bool, (12, 11), elements=st.booleans() | st.just(value=False)))
def test_the_nearest_cell_is_that_of_the_slow_twin(mask: np.ndarray) -> None:
    cells = np.argwhere(np.ones_like(mask))
    near, nearest = goals_module._nearest(mask, cells, 8.0)
    for cell, is_near, found in zip(cells, near, nearest.tolist(), strict=True):
        away, expected = nearest_of(mask, cell)
        assert is_near == (away <= 8.0)
        assert not is_near or tuple(found) == expected


@pytest.mark.parametrize(("width", "creeps"), [(20, False), (4, True)])
def test_a_border_is_viewed_from_where_the_robot_need_not_creep(width: int, creeps: bool) -> None:
    """4 cells: what lies beside the corridor was not seen either."""
    beside = [" " * 40] * ((20 - width) // 2)
    here = standing(drawn_map(*beside, *["." * 30 + " " * 10] * width, *beside), (0.95, 1.0))
    borders = frontier_goals(find_frontiers(here.map_view, here.costmap), here)
    assert borders
    for goal in borders:
        assert here.costmap.creeping[tuple(here.cell_at(goal.viewpoint_xy))] == creeps
        assert math.dist(goal.viewpoint_xy, goal.look_xy) < 0.6
