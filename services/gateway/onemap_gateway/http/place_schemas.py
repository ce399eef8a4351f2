"""What clients send about a place."""

from __future__ import annotations

from pydantic import ConfigDict, Field, model_validator

from onemap_gateway.http.schemas import Place, RequestModel
from onemap_shared import messages as m

HERE = (0.0, 0.0)  # stands for the robot's place while a request is checked


class PlaceRequest(RequestModel):
    """Where a place is: ``inside_m`` or ``corners_m``; without both, the room of the robot."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"inside_m": [2.5, -1.0]},
                {},
                {"corners_m": [[0, 0], [2, 0], [2, 1.5], [0, 1.5]], "kind": "keep_out"},
            ]
        }
    )

    inside_m: Place | None = Field(default=None, description="x, y in the room, metres.")
    corners_m: list[Place] | None = Field(
        default=None, description=f"x, y of 3 to {m.MAX_CORNERS} corners, in their order, metres."
    )
    kind: m.PlaceKind = Field(
        default=m.PlaceKind.ROOM, description="keep_out: no robot enters it from now on."
    )

    @model_validator(mode="after")
    def _is_place(self) -> PlaceRequest:
        self.place("any", HERE)
        return self

    @property
    def is_here(self) -> bool:
        """Whether the room of the robot is meant."""
        return self.inside_m is None and self.corners_m is None

    def place(self, name: str, robot_m: tuple[float, ...]) -> m.Place:
        """The place of this name, with the robot at ``robot_m``; ValueError if there is none."""
        inside_m = robot_m if self.is_here else self.inside_m or ()
        return m.Place(name, self.kind, inside_m, tuple(self.corners_m or ()))
