"""Why the robot drives where it drives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class ChoiceOption:
    """A goal that was weighed.

    kind: frontier, region, detection, go_to or look_at; xy_m: what the robot would look at; score:
    0 to 1; travel_m: of way to it; utility: what goals are ranked by; chosen: whether the robot
    drives there.
    """

    kind: str
    xy_m: tuple[float, float]
    score: float
    travel_m: float
    utility: float
    chosen: bool
    document: Mapping[str, Any] = field(repr=False, compare=False)

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> ChoiceOption:
        """The option that ``document`` describes."""
        x, y = document["xy_m"]
        return cls(
            kind=str(document["kind"]),
            xy_m=(float(x), float(y)),
            score=float(document["score"]),
            travel_m=float(document["travel_m"]),
            utility=float(document["utility"]),
            chosen=bool(document["chosen"]),
            document=document,
        )


@dataclass(frozen=True, slots=True)
class Choice:
    """Where the robot drives, and why.

    number: counts the decisions of the search, from 1; sentence: why the chosen goal won; options:
    the best that were weighed, best first; left_out: how many more there were.
    """

    number: int
    sentence: str
    options: tuple[ChoiceOption, ...]
    left_out: int
    document: Mapping[str, Any] = field(repr=False, compare=False)

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> Choice:
        """The choice that ``document`` describes."""
        return cls(
            number=int(document["number"]),
            sentence=str(document["sentence"]),
            options=tuple(map(ChoiceOption.of, document["options"])),
            left_out=int(document.get("left_out", 0)),
            document=document,
        )
