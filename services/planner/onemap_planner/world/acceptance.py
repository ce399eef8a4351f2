"""Whether a detected thing is the object although the map does not say so: a likelihood ratio.

Two hypotheses about a thing that the detector finds again and again: it is the object, and the
map mistakes it for something else; or it is another thing that the detector mistakes for good.
What tells them apart is how often the detector finds it from near, and how far below the most
similar cells the thing's cells rank on the map.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field, PositiveFloat, PositiveInt

from onemap_shared.params import Params

SAME_SIDE_M = 0.8  # views from places nearer to each other are of one side: 45 degrees at 1 m
MOST_SCALES = 3.0  # within which 95 percent of an exponential distribution lie


class AcceptanceParams(Params):
    """Rates of the detector's and of the map's errors, by which they outweigh each other."""

    detected: float = Field(
        default=0.7,
        gt=0,
        lt=1,
        description="Share of the near views in which the detector finds an object that is there: "
        "of an open-vocabulary detector in homes, roughly.",
    )
    mistaken: float = Field(
        default=0.5,
        gt=0,
        lt=1,
        description="The same of another thing that it takes for the object for good: its scores "
        "lie near the threshold, so that it flickers.",
    )
    mistaken_things: PositiveFloat = Field(
        default=0.65,
        description="Such things in a flat, for each object that is there: 130 things, of which "
        "the detector takes 0.5 percent for a given name.",
    )
    looks_different: float = Field(
        default=0.06,
        gt=0,
        lt=1,
        description="Share of the objects that the map takes for something else: that of the "
        "simulated encoder; mini gets 0.09 of the pixels wrong.",
    )
    rank_scale: float = Field(
        default=0.1,
        gt=0,
        le=1,
        description="How far below the most similar cells the rank of such an object lies, as a "
        "part of the map, on average: what is confused is similar. Any other thing has any rank.",
    )
    certain: float = Field(
        default=0.95,
        gt=0.5,
        lt=1,
        description="Probability from which it is the object, and its complement from which it is "
        "not: one wrong in twenty of those that the map does not support.",
    )
    views_per_viewpoint: PositiveInt = Field(
        default=30,
        description="Frames from one place that count, 7.5 s at 4 Hz: more show the same again, "
        "and the robot looks from another side.",
    )


@dataclass(frozen=True, slots=True)
class ViewpointTally:
    """Near views from one place, xy metres: frames, and those in which the object was detected."""

    xy: tuple[float, float]
    hits: int
    frames: int


def with_view(
    tallies: tuple[ViewpointTally, ...], xy: tuple[float, float], *, hit: bool
) -> tuple[ViewpointTally, ...]:
    """The tallies with one more near view from ``xy``, metres."""
    for index, tally in enumerate(tallies):
        if np.hypot(tally.xy[0] - xy[0], tally.xy[1] - xy[1]) <= SAME_SIDE_M:
            more = replace(tally, hits=tally.hits + hit, frames=tally.frames + 1)
            return (*tallies[:index], more, *tallies[index + 1 :])
    return (*tallies, ViewpointTally(xy, int(hit), 1))


def probability(tallies: Iterable[ViewpointTally], rank: float, params: AcceptanceParams) -> float:
    """Probability that it is the object, in [0, 1].

    rank: of its cells' cosine on the map, 1 the most similar; NaN (nothing is known) gives 0, and
    so does a rank lower than that of 95 percent of the objects that look different: a map that
    says clearly that it is something else is not outweighed by any number of views.
    """
    if not 1 - rank <= MOST_SCALES * params.rank_scale:  # also refuses NaN
        return 0.0
    odds = np.log(params.looks_different / params.rank_scale) - (1 - rank) / params.rank_scale
    odds -= np.log(params.mistaken_things)
    odds += sum(_evidence(tally, params) for tally in tallies)
    return float(1 / (1 + np.exp(-odds)))


def _evidence(tally: ViewpointTally, params: AcceptanceParams) -> float:
    """Logarithm of the likelihood ratio of the views from one place."""
    hit = np.log(params.detected / params.mistaken)
    miss = np.log((1 - params.detected) / (1 - params.mistaken))
    counted = min(1.0, params.views_per_viewpoint / tally.frames)
    return float(counted * (tally.hits * hit + (tally.frames - tally.hits) * miss))
