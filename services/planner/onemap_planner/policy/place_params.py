"""Parameters of a drive to a place."""

from __future__ import annotations

from pydantic import Field, PositiveFloat

from onemap_shared.params import Params


class PlaceParams(Params):
    """When a place counts as reached or seen, and what the unknown floor on the way costs."""

    tolerance_m: PositiveFloat = Field(
        default=0.5,
        description="Metres from a place where the robot cannot stand that still count as there: "
        "from its centre to what an arm or a voice reaches.",
    )
    view_nearest_m: PositiveFloat = Field(
        default=0.8,
        description="Metres from which a place is looked at, at least: nearer, the "
        "camera looks over low things.",
    )
    view_farthest_m: PositiveFloat = Field(
        default=3.0,
        description="Metres from which a place is looked at, at most: farther, the floor is seen "
        "at less than 20 degrees from a camera at 1 m.",
    )
    unknown_cost: float = Field(
        default=1.5,
        ge=1,
        description="Cost of a metre of unknown floor, in metres of known floor, when the way is "
        "planned: a known way is preferred if it is at most half as long again. The robot drives "
        "on known floor only.",
    )
