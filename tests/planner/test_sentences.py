"""The sentences of the robot's decisions, word for word."""

from __future__ import annotations

from math import pi

import pytest

from onemap_planner.sentences import (
    AFAR,
    ALIKE,
    SEEN,
    UNEXPLORED,
    Gain,
    Landmarks,
    approaching,
    gained,
    goal_sentence,
    onward,
)

SOFA, TV = ("sofa", (2.0, 0.0)), ("the tv", (0.0, -4.0))
HERE = Landmarks((0.0, 0.0), 0.0, (SOFA, TV))
LIKENESS, PROMISE, WAY = Gain


@pytest.mark.parametrize(
    ("xy", "yaw_rad", "said"),
    [
        ((3.0, 0.2), 0.0, "behind the sofa"),
        ((1.0, 0.2), 0.0, "near the sofa"),
        ((2.0, 1.2), 0.0, "near the sofa"),
        ((0.0, -5.0), 0.0, "behind the tv"),
        ((0.3, 0.3), 0.0, "where the robot stands"),
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


@pytest.mark.parametrize(
    ("sentence", "said"),
    [
        (
            goal_sentence(
                ALIKE,
                "behind the sofa",
                "kettle",
                gained([(LIKENESS, True), (WAY, True)], like=True),
            ),
            "going to the place behind the sofa: it looks most like a kettle and is the nearest",
        ),
        (
            goal_sentence(
                UNEXPLORED,
                "3 m ahead",
                "armchair",
                gained([(PROMISE, False), (WAY, True)], like=False),
            ),
            "going to the unexplored space 3 m ahead: it is the nearest and promises more than "
            "the next best place",
        ),
        (
            goal_sentence(AFAR, "5 m to the left", "my keys", gained([(WAY, True)], like=False)),
            "going to a place 5 m to the left that was only seen from afar: it is the nearest",
        ),
        (
            goal_sentence(SEEN, "near the bed", "scissors", gained([], like=True)),
            "going for a closer look at what may be scissors near the bed: it looks like scissors",
        ),
        (
            goal_sentence(onward("the place (1.00, 2.00)"), "2 m ahead", ""),
            "going to the unexplored space 2 m ahead, on the way to the place (1.00, 2.00)",
        ),
        (
            approaching("bed", 3, "4 m to the right"),
            "walking up to what looks like a bed 4 m to the right: the camera saw it 3 times and "
            "the map agrees",
        ),
    ],
)
def test_a_sentence_is_plain(sentence: str, said: str) -> None:
    assert sentence == said
