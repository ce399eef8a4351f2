"""Parameters of the order of objects, and what is remembered of those that wait."""

from __future__ import annotations

from dataclasses import dataclass

from pydantic import Field, PositiveFloat

from onemap_planner.world.regions import LikelyPlace
from onemap_shared.params import Params


class ObjectOrderParams(Params):
    """How the cheapest order of a search in any order is estimated."""

    likely: float = Field(
        default=0.5,
        gt=0,
        le=1,
        description="Similarity from which a place counts as one of the object: from the lower "
        "threshold of regions on, three of four places are something else.",
    )
    sighted_probability: float = Field(
        default=0.9,
        gt=0,
        le=1,
        description="Probability of a place where detections agreed often enough to walk up to it.",
    )
    uncalibrated_probability: float = Field(
        default=0.6,
        gt=0,
        le=1,
        description="Probability of the best match of an encoder without calibration: every map "
        "has a best match.",
    )
    explore_m: PositiveFloat = Field(
        default=15.0,
        description="Metres of way to an object that the map shows nowhere: the mean path of a "
        "search in apartments of 70 to 120 square metres.",
    )
    return_m: PositiveFloat = Field(
        default=8.0,
        description="Metres of way from where an exploration ends to a place known before: half "
        "of such an apartment's length.",
    )
    margin_m: float = Field(
        default=2.0,
        ge=0,
        description="Metres by which another order must be cheaper than the best that goes on "
        "with the present object: what a turn around costs.",
    )
    period_s: PositiveFloat = Field(
        default=1.0, description="Seconds between two revisions: the map changes little in less."
    )
    view_period_s: PositiveFloat = Field(
        default=0.5,
        description="Seconds after which the map is asked about the next object that waits: one "
        "question more for every two plans.",
    )


@dataclass(frozen=True, slots=True)
class OrderMemory:
    """places: of the objects that the map was asked about, by their indices; turn: the last turn
    of asking; decided_s: active time of the last revision, None before the first."""

    places: tuple[tuple[int, tuple[LikelyPlace, ...]], ...] = ()
    turn: int = -1
    decided_s: float | None = None

    def of(self, index: int) -> tuple[LikelyPlace, ...]:
        """The places of an object."""
        return next((places for known, places in self.places if known == index), ())

    def updated(self, index: int, places: tuple[LikelyPlace, ...]) -> OrderMemory:
        """The memory with these places of an object."""
        others = tuple(entry for entry in self.places if entry[0] != index)
        return OrderMemory((*others, (index, places)), self.turn, self.decided_s)
