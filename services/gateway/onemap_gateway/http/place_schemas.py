"""What clients send about places: one place, or a GeoJSON file of them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue, TypeAdapter, model_validator

from onemap_gateway.http.schemas import Coordinate, Place, RequestModel, exactly_one_of
from onemap_shared import messages as m

HERE = (0.0, 0.0)  # stands for the robot's place while a request is checked


class PlaceRequest(RequestModel):
    """Where a place is: exactly one of ``inside_m``, ``here`` and ``corners_m``."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": exactly_one_of("inside_m", "here", "corners_m"),
            "examples": [
                {"inside_m": [2.5, -1.0]},
                {"here": True},
                {"corners_m": [[0, 0], [2, 0], [2, 1.5], [0, 1.5]], "kind": "keep_out"},
            ],
        }
    )

    inside_m: Place | None = Field(default=None, description="x, y in the room, metres.")
    here: Literal[True] | None = Field(default=None, description="The room of the robot.")
    corners_m: list[Place] | None = Field(
        default=None, description=f"x, y of 3 to {m.MAX_CORNERS} corners, in their order, metres."
    )
    kind: m.PlaceKind = Field(
        default=m.PlaceKind.ROOM, description="keep_out: no robot enters it from now on."
    )

    @model_validator(mode="after")
    def _exactly_one(self) -> PlaceRequest:
        members = (self.inside_m, self.here, self.corners_m)
        if sum(member is not None for member in members) != 1:
            raise ValueError(
                "give exactly one of 'inside_m', [x, y] in metres, 'here', true, and 'corners_m', "
                'a list of [x, y]; for example {"inside_m": [2.5, -1.0]}'
            )
        self.place("any", HERE)
        return self

    def place(self, name: str, robot_m: tuple[float, ...]) -> m.Place:
        """The place of this name, with the robot at ``robot_m``; ValueError if there is none."""
        if self.corners_m is not None:
            return m.Place(name, self.kind, corners_m=tuple(self.corners_m))
        return m.Place(name, self.kind, self.inside_m or robot_m)


class Foreign(BaseModel):
    """A part of GeoJSON, which other programs may have added members to."""

    model_config = ConfigDict(extra="ignore")


class PlaceProperties(Foreign):
    """``inside_m``: a point in a room, whatever the geometry is."""

    name: str
    kind: m.PlaceKind = m.PlaceKind.ROOM
    inside_m: Place | None = None


class Geometry(Foreign):
    """A Point in a room or a Polygon without holes; any other where ``inside_m`` is given."""

    type: str
    coordinates: JsonValue


Position = Annotated[list[Coordinate], Field(min_length=2, max_length=3)]
POINT, RINGS = TypeAdapter(Position), TypeAdapter(list[list[Position]])


class PlaceFeature(Foreign):
    """A place."""

    type: Literal["Feature"]
    properties: PlaceProperties
    geometry: Geometry | None = None

    @model_validator(mode="after")
    def _is_place(self) -> PlaceFeature:
        self.place()
        return self

    def place(self) -> m.Place:
        """The place; raises ValueError with its name if there is none."""
        given, name = self.properties, self.properties.name[: m.MAX_TEXT_CHARS]
        where: dict[str, Any] = {"inside_m": given.inside_m}
        if given.inside_m is None:
            where = self._where(name)
        try:
            return m.Place(given.name, given.kind, **where)
        except ValueError as problem:
            raise ValueError(f"the place {name!r}: {problem}") from None

    def _where(self, name: str) -> dict[str, Any]:
        shape = self.geometry
        try:
            if shape is not None and shape.type == "Point":
                return {"inside_m": tuple(POINT.validate_python(shape.coordinates)[:2])}
            if shape is not None and shape.type == "Polygon":
                (ring,) = RINGS.validate_python(shape.coordinates)
                corners = [(corner[0], corner[1]) for corner in ring]
                return {"corners_m": tuple(corners[:-1] if corners[0] == corners[-1] else corners)}
        except (ValueError, IndexError):
            pass
        raise ValueError(
            f"the place {name!r} is no Point and no Polygon without holes, of metres in the map "
            "frame, and has no 'inside_m' in its properties: give one of these"
        )


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
    def _different(self) -> PlaceCollection:
        m.different_names(self.places)
        return self

    @property
    def places(self) -> tuple[m.Place, ...]:
        """All places, in their order."""
        return tuple(feature.place() for feature in self.features)
