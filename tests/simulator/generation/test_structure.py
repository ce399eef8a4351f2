"""The structure of an apartment closes its rooms except at openings."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.floor_plan import FloorPlan, Opening, sample_floor_plan
from onemap_simulator.generation.room_layout import PlacedModel
from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.generation.structure import (
    doors_and_windows,
    facing_yaw_deg,
    room_surfaces,
)
from onemap_simulator.generation.style import TRAINING
from tests.simulator.generation.layouts import PLAN


def sampler(seed: int = 0) -> Sampler:
    return Sampler(np.random.default_rng(seed), TRAINING)


def boxes(items: list[PlacedModel]) -> np.ndarray:
    """Boxes (N, 2, 3) of the meshes of placed models."""
    found = []
    for item in items:
        for part in item.model.parts:
            vertices = part.mesh.vertices
            found.append([vertices.min(axis=0), vertices.max(axis=0)])
    return np.array(found)


def covered(pieces: np.ndarray, point: np.ndarray) -> bool:
    return bool(((pieces[:, 0] <= point) & (point <= pieces[:, 1])).all(axis=1).any())


@pytest.mark.parametrize("plan", [PLAN, *(sample_floor_plan(sampler(s)) for s in (1, 2))])
def test_walls_are_closed_except_at_openings(plan: FloorPlan) -> None:
    surfaces = room_surfaces(plan, sampler())
    walls = boxes([item for item in surfaces if item.model.category == "wall"])
    rng = np.random.default_rng(0)
    for index, space in enumerate(plan.spaces):
        for side in ("west", "south", "east", "north"):
            axis, line, start, end = space.side(side)
            across = line + 0.03 * (1 if side in ("west", "south") else -1)
            points = np.column_stack([rng.uniform(start, end, 40), rng.uniform(0.01, 2.4, 40)])
            for along, height in points:
                point = np.array([along, across, height] if axis == 0 else [across, along, height])
                hole = any(
                    index in opening.spaces
                    and opening.axis == axis
                    and abs(opening.line - line) < 1e-6
                    and opening.start - 0.01 < along < opening.end + 0.01
                    and opening.sill - 0.01 < height < opening.top + 0.01
                    for opening in (*plan.doors, plan.entrance, *plan.windows)
                )
                assert covered(walls, point) != hole


def test_every_room_has_a_floor_at_zero_and_a_ceiling() -> None:
    surfaces = room_surfaces(PLAN, sampler())
    for category, low, high in (("floor", -0.02, 0.0), ("ceiling", 2.5, 2.52)):
        items = [item for item in surfaces if item.model.category == category]
        assert [item.space for item in items] == [0, 1]
        for item, space in zip(items, PLAN.spaces, strict=True):
            np.testing.assert_allclose(item.box[:, 2], (low, high), atol=1e-9)
            np.testing.assert_allclose(item.box[:, :2].ravel(), space.rect)


@pytest.mark.parametrize(
    ("opening", "space", "inward"),
    [
        (PLAN.doors[0], 0, (0, -1)),
        (PLAN.doors[0], 1, (0, 1)),
        (PLAN.entrance, 0, (1, 0)),
        (PLAN.windows[0], 1, (0, -1)),
    ],
)
def test_the_front_of_a_model_in_an_opening_points_into_the_room(
    opening: Opening, space: int, inward: tuple[int, int]
) -> None:
    yaw = np.radians(facing_yaw_deg(opening, PLAN, space))
    front = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]) @ (0, -1)
    np.testing.assert_allclose(front, inward, atol=1e-9)


def test_every_opening_is_filled_and_passages_stay_clear() -> None:
    for seed in range(6):
        plan = sample_floor_plan(sampler(seed))
        items = doors_and_windows(plan, sampler(seed))
        kinds = [item.model.category for item in items]
        assert kinds.count("window") == len(plan.windows)
        assert kinds.count("door") == len(plan.doors) + 1
        for door, item in zip(plan.doors, items, strict=False):
            for part in item.model.parts:
                R = np.radians(item.yaw_deg)
                rotation = np.array([[np.cos(R), -np.sin(R)], [np.sin(R), np.cos(R)]])
                xy = part.mesh.vertices[:, :2] @ rotation.T + item.position_m[:2]
                along, across = xy[:, door.axis], xy[:, 1 - door.axis]
                in_wall = np.abs(across - door.line) < 0.05
                low = part.mesh.vertices[:, 2] < door.top - 0.05
                inside = (along > door.start + 0.02) & (along < door.end - 0.02)
                assert not (in_wall & low & inside).any()
