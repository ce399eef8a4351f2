"""Guitars, teddy bears and balls."""

from __future__ import annotations

from onemap_simulator.generation.sampler import ModelFactory
from onemap_tools.train.variety.designs import balls, guitars, teddy_bears

DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "guitar": (
        guitars.acoustic_guitar,
        guitars.double_cutaway,
        guitars.single_cutaway,
        guitars.angular_guitar,
        guitars.ukulele,
    ),
    "teddy bear": (
        teddy_bears.sitting_bear,
        teddy_bears.standing_bear,
        teddy_bears.jointed_bear,
        teddy_bears.lying_bear,
        teddy_bears.blocky_bear,
    ),
    "ball": (
        balls.football,
        balls.basketball,
        balls.beach_ball,
        balls.exercise_ball,
        balls.rugby_ball,
        balls.tennis_ball,
    ),
}
