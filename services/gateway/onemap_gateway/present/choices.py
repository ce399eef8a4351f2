"""Why the robot drives where it drives, as clients get it."""

from __future__ import annotations

from pydantic import BaseModel, Field
from pydantic.config import JsonDict

from onemap_gateway.present.formats import DECIMALS, millimetres
from onemap_shared.messages import GoalChoice


class OptionReport(BaseModel):
    """A goal that the planner weighed."""

    kind: str = Field(description="frontier, region, detection, go_to or look_at.")
    xy_m: tuple[float, float] = Field(description="x, y of what the robot would look at.")
    score: float = Field(description="Similarity expected there, 0 to 1; 0 for a place.")
    travel_m: float = Field(description="Metres of way to where the robot would stand.")
    utility: float = Field(description="Goals are ranked by it: score and size less the way.")
    chosen: bool = Field(description="Whether the robot drives there.")


class ChoiceReport(BaseModel):
    """Where the robot drives, and why."""

    number: int = Field(description="Counts the decisions of the search, from 1.")
    sentence: str = Field(description="Why the chosen goal won.")
    options: list[OptionReport] = Field(
        description="The best of the goals that were weighed, at most 5, the chosen one among them."
    )
    left_out: int = Field(description="Goals that were weighed and are not listed.")


CHOICE_EXAMPLE: JsonDict = {
    "number": 3,
    "sentence": "utility 0.52, 0.11 more than the region at (4.1, 0.3): its way is shorter (1.2 m "
    "against 5.0 m)",
    "options": [
        {
            "kind": "frontier",
            "xy_m": [1.8, -0.4],
            "score": 0.55,
            "travel_m": 1.2,
            "utility": 0.52,
            "chosen": True,
        },
        {
            "kind": "region",
            "xy_m": [4.1, 0.3],
            "score": 0.61,
            "travel_m": 5.0,
            "utility": 0.41,
            "chosen": False,
        },
    ],
    "left_out": 0,
}


def choice_report(choice: GoalChoice) -> ChoiceReport | None:
    """The choice in decimals that people read; None while the robot has no goal."""
    if not choice.options:
        return None
    options = [
        OptionReport(
            kind=option.kind,
            xy_m=millimetres(option.xy_m),
            score=round(option.score, DECIMALS),
            travel_m=round(option.travel_m, DECIMALS),
            utility=round(option.utility, DECIMALS),
            chosen=option.chosen,
        )
        for option in choice.options
    ]
    return ChoiceReport(
        number=choice.number, sentence=choice.sentence, options=options, left_out=choice.left_out
    )
