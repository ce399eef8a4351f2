"""The sentences of the robot's decisions, word for word."""

from __future__ import annotations

from math import pi

import pytest

from onemap_planner.sentences import Landmarks

SOFA, TV = ("sofa", (2.0, 0.0)), ("the tv", (0.0, -4.0))
HERE = Landmarks((0.0, 0.0), 0.0, (SOFA, TV))


@pytest.mark.parametrize(
    ("xy", "yaw_rad", "said"),
    [
        ((3.0, 0.2), 0.0, "behind the sofa"),
        ((1.0, 0.2), 0.0, "near the sofa"),
        ((2.0, 1.2), 0.0, "near the sofa"),
        ((0.0, -5.0), 0.0, "behind the tv"),
        ((0.3, 0.3), 0.0, "next to the robot"),
        ((4.9, 0.0), 0.0, "5 m ahead"),
        ((2.0, 2.0), 0.0, "3 m ahead to the left"),
        ((0.0, 3.0), 0.0, "3 m to the left"),
        ((0.0, 3.0), pi / 2, "3 m ahead"),
        ((0.0, 3.0), -3.0, "3 m to the right"),
        ((-3.0, -1.0), 0.0, "3 m behind the robot"),
    ],
)
def test_a_place_is_described_by_what_is_known_near_it_or_from_the_robot(
    xy: tuple[float, float], yaw_rad: float, said: str
) -> None:
    assert Landmarks(HERE.xy, yaw_rad, HERE.things).where(xy) == said
