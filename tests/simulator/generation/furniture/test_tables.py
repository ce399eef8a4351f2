from __future__ import annotations

import pytest

from onemap_simulator.generation.furniture.tables import coffee_table, desk, table
from onemap_simulator.generation.sampler import ModelFactory
from tests.simulator.generation.furniture.draws import draws, extents


@pytest.mark.parametrize(
    ("factory", "low", "high"), [(table, 0.7, 0.78), (coffee_table, 0.35, 0.5), (desk, 0.7, 0.78)]
)
def test_objects_stand_on_the_board_at_the_usual_height(
    factory: ModelFactory, low: float, high: float
) -> None:
    for model in draws(factory):
        (top,) = model.support_surfaces
        assert top.z == pytest.approx(model.upper[2])
        assert low <= top.z <= high


def test_tables_are_round_or_rectangular() -> None:
    for factory in (table, coffee_table):
        size = extents(draws(factory, 20))
        round_ones = abs(size[:, 0] - size[:, 1]) < 0.02
        assert round_ones.any()
        assert not round_ones.all()


def test_a_desk_leaves_space_for_the_knees_in_front() -> None:
    for model in draws(desk):
        parts = [part.mesh.vertices for part in model.parts]
        knees = [
            points
            for points in parts
            if (points[:, 1].min() < -0.2)
            and points[:, 0].min() < -0.05
            and points[:, 0].max() > 0.05
            and points[:, 2].min() < 0.5
        ]
        assert knees == []
