"""A frontier, and the parameters by which it is found."""

from __future__ import annotations

from dataclasses import dataclass

from pydantic import Field, PositiveFloat

from onemap_shared.geometry import F64, I64
from onemap_shared.params import Params


class FrontierParams(Params):
    """What counts as a frontier."""

    min_length_m: PositiveFloat = Field(
        default=0.4, description="Metres; shorter borders are gaps that the robot cannot pass."
    )
    max_length_m: PositiveFloat = Field(
        default=2.5,
        description="Metres; longer borders are cut, so that each piece has a middle near it.",
    )
    min_beyond_m2: PositiveFloat = Field(
        default=0.15, description="Square metres; smaller unknown or unexplored spots are noise."
    )
    blind_spot_m2: PositiveFloat = Field(
        default=3.0,
        description="Square metres of unknown floor amid known floor that are no frontier: a "
        "camera at 1 m does not see a circle of 1.1 m around the robot.",
    )
    unknown_prior: float = Field(
        default=0.2,
        ge=0,
        le=1,
        description="Similarity expected in ``view_scale_m2`` of unknown space: above the usual "
        "0.1 of other objects, so that the unknown is preferred to a second look at them.",
    )
    most_expected: float = Field(
        default=0.6,
        ge=0,
        le=1,
        description="Similarity that no unknown space exceeds, however large: what is clearly "
        "like the object comes first.",
    )
    view_m: PositiveFloat = Field(
        default=4.0,
        description="Metres of unknown space in view from a frontier that count for what it may "
        "show: the depth of a room.",
    )
    view_scale_m2: PositiveFloat = Field(
        default=16.0,
        description="Square metres of unknown space in view for which the prior is expected: a "
        "room. More counts in proportion: a pocket behind a chair shows 0.3.",
    )
    hint_m: PositiveFloat = Field(
        default=2.5,
        description="Metres around a frontier, to each side, whose likeness to the object says "
        "what may be beyond: a small room.",
    )
    hint_weight: float = Field(
        default=1.0,
        ge=0,
        le=1,
        description="Part of the prior that the surroundings may add or take: with 1, between "
        "nothing beside what is least like the object and twice the prior beside what is most "
        "like it.",
    )
    blind_radius_m: PositiveFloat = Field(
        default=1.2,
        description="Metres around the robot's way within which unknown floor tells nothing: a "
        "camera at 1 m sees the floor from 1.1 m on, but what stands there it saw above it.",
    )
    decay_per_m: PositiveFloat = Field(
        default=0.3,
        description="Similarity that a cell beyond the border loses per metre of way from it: a "
        "certain match counts for 2.7 m, one below the prior of the unknown sooner.",
    )


@dataclass(frozen=True, slots=True)
class Frontier:
    """A segment of a border.

    cells (K, 2) int64: free cells on this side; beyond_xy (2,) metres: middle of what lies
    directly beyond; score in [0, 1]: the highest similarity in O - E reachable there, less
    the way to it, and for a border of the unknown at least what the unknown area in view lets
    expect; ``unknown`` names the kind of border.
    """

    cells: I64
    beyond_xy: F64
    score: float
    unknown: bool
