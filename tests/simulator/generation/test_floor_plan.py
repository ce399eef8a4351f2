from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.floor_plan import (
    HALF_WALL_M,
    FloorPlan,
    Space,
    sample_floor_plan,
)
from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.generation.style import HELD_OUT, TRAINING


def plan_of(seed: int) -> FloorPlan:
    style = HELD_OUT if seed % 2 else TRAINING
    return sample_floor_plan(Sampler(np.random.default_rng(seed), style))


def test_the_inner_rectangle_leaves_the_walls_out() -> None:
    assert Space("study", (0.0, 0.0, 3.0, 2.0)).inner == pytest.approx(
        (HALF_WALL_M, HALF_WALL_M, 3.0 - HALF_WALL_M, 2.0 - HALF_WALL_M)
    )


@pytest.mark.parametrize("seed", range(12))
def test_plans_are_sound(seed: int) -> None:
    plan = plan_of(seed)
    assert 5 <= len(plan.spaces) <= 7
    assert {door.spaces[1] for door in plan.doors if door.spaces[0] == 0} == set(
        range(1, len(plan.spaces))
    )
    for door in (*plan.doors, plan.entrance):
        assert door.width >= 0.9
        assert door.top >= 2.0
        for index in door.spaces:
            x0, y0, x1, y1 = plan.spaces[index].rect
            x, y = door.centre
            assert x0 - 1e-6 <= x <= x1 + 1e-6
            assert y0 - 1e-6 <= y <= y1 + 1e-6
    for window in plan.windows:
        assert 0 < window.sill < window.top < plan.height_m


@pytest.mark.parametrize("seed", range(12))
def test_windows_lie_in_outer_walls_and_do_not_overlap(seed: int) -> None:
    plan = plan_of(seed)
    rects = np.array([space.rect for space in plan.spaces])
    outline = (*rects[:, :2].min(axis=0), *rects[:, 2:].max(axis=0))
    openings = (*plan.windows, plan.entrance)
    for window in openings:
        across = 1 - window.axis
        assert (
            min(abs(window.line - outline[across]), abs(window.line - outline[across + 2])) < 1e-6
        )
        x0, y0, x1, y1 = plan.spaces[window.spaces[0]].inner
        low, high = ((x0, x1), (y0, y1))[window.axis]
        assert low < window.start < window.end < high
    for index, one in enumerate(openings):
        for other in openings[index + 1 :]:
            if (one.axis, one.line) == (other.axis, other.line):
                assert one.end <= other.start or other.end <= one.start


@pytest.mark.parametrize("seed", range(12))
def test_the_bathroom_is_the_smallest_room_besides_the_hub(seed: int) -> None:
    plan = plan_of(seed)
    areas = {
        space.kind: (space.rect[2] - space.rect[0]) * (space.rect[3] - space.rect[1])
        for space in plan.spaces[1:]
    }
    assert min(areas, key=lambda kind: areas[kind]) == "bathroom"
