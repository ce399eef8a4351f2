"""The picture of an episode: one line per object over the floor plan."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.physics.robot import RobotParams
from onemap_tools.bench.navigation.picture import COLOURS, episode_picture, paths_of
from tests.tools.bench.navigation.records import episode, found

WALK = replace(
    episode(0, found("bed", 1, 1), found("fan", 1, 1)),
    trajectory=tuple((float(x), 0.0) for x in range(9)),
)


def test_the_trajectory_is_cut_where_the_next_object_begins() -> None:
    first, second = paths_of(WALK)
    np.testing.assert_array_equal(first[:, 0], range(5))
    np.testing.assert_array_equal(second[:, 0], range(4, 9))
    assert paths_of(replace(WALK, trajectory=())) == []


@pytest.mark.slow
def test_each_path_is_drawn_in_its_colour() -> None:
    x, y, yaw = generate_apartment(1).start
    steps = np.linspace(0, 0.6, 9)
    there = replace(WALK, start=(x, y, yaw), trajectory=tuple((x + s, y) for s in steps))
    image = episode_picture(there, "training", RobotParams())
    for colour in COLOURS[:2]:
        assert (image == colour).all(axis=-1).any()
