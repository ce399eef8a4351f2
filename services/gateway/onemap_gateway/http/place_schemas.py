"""What clients send about places: one place, or a GeoJSON file of them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    JsonValue,
    TypeAdapter,
    ValidationError,
    model_validator,
)

from onemap_gateway.http.schemas import Coordinate, Place, RequestModel
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


class Foreign(BaseModel):
    """A part of GeoJSON, which other programs may have added members to."""

    model_config = ConfigDict(extra="ignore")


class PlaceProperties(Foreign):
    """``inside_m``: a point in a room, whatever the geometry is."""

    name: str
    kind: m.PlaceKind = m.PlaceKind.ROOM
    inside_m: Place | None = None


Position = Annotated[list[Coordinate], Field(min_length=2, max_length=3)]
POSITIONS = TypeAdapter(list[Position])


class PlaceFeature(Foreign):
    """A place: a Point in a room, or a Polygon without holes."""

    type: Literal["Feature"]
    properties: PlaceProperties
    geometry: JsonValue = None

    def place(self) -> m.Place:
        """The place; raises ValueError with its name if there is none."""
        given = self.properties
        where = {"inside_m": given.inside_m} if given.inside_m else _where(self.geometry)
        try:
            return m.Place(given.name, given.kind, **where)
        except ValueError as problem:
            raise ValueError(
                f"the feature {given.name[: m.MAX_TEXT_CHARS]!r} is to be a Point in a room or a "
                f"Polygon without holes, in metres of the map frame: {problem}"
            ) from None


def _where(geometry: JsonValue) -> dict[str, Any]:
    """The geometry as members of a place; none if it is of another type or damaged."""
    try:
        match geometry:
            case {"type": "Point", "coordinates": point}:
                return {"inside_m": tuple(POSITIONS.validate_python([point])[0][:2])}
            case {"type": "Polygon", "coordinates": [ring]}:
                corners = [(corner[0], corner[1]) for corner in POSITIONS.validate_python(ring)]
                return {"corners_m": tuple(corners[: -1 if corners[:1] == corners[-1:] else None])}
    except ValidationError:
        pass
    return {}


class PlaceCollection(Foreign):
    """A GeoJSON FeatureCollection in metres of the map frame, not in degrees."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "type": "FeatureCollection",
                    "features": [
                        {
                            "type": "Feature",
                            "properties": {"name": "stairs", "kind": "keep_out"},
                            "geometry": {
                                "type": "Polygon",
                                "coordinates": [[[0, 0], [2, 0], [2, 1], [0, 1], [0, 0]]],
                            },
                        }
                    ],
                }
            ]
        }
    )

    type: Literal["FeatureCollection"]
    features: Annotated[list[PlaceFeature], Field(max_length=m.MAX_PLACES)]

    @model_validator(mode="after")
    def _is_change(self) -> PlaceCollection:
        self.change()
        return self

    def change(self) -> m.PlacesChange:
        """All places, in their order; raises ValueError if they do not fit each other."""
        return m.PlacesChange(tuple(feature.place() for feature in self.features))
