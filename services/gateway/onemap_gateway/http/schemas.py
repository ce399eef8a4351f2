"""What clients send over HTTP, with examples for the documentation."""

from __future__ import annotations

from base64 import b64decode
from typing import Annotated

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    JsonValue,
    StrictStr,
    WithJsonSchema,
    model_validator,
)

from onemap_shared.geometry import MAX_COORDINATE_M
from onemap_shared.messages import (
    MAX_IMAGE_BYTES,
    MAX_NEGATIVES,
    MAX_OBJECTS,
    MAX_TEXT_CHARS,
    ImageSimilarityRequest,
    SearchKind,
    SearchOrder,
    SearchRequest,
    SimilarityRequest,
    check_image,
    check_text,
)

DATA_URL = "data:image/"


def image_bytes(value: object) -> bytes:
    """The PNG or JPEG that a member of a body holds; ValueError says what is wrong with it."""
    if not isinstance(value, str):
        raise ValueError("'image' must be a string: a PNG or JPEG in base64")
    head, separator, rest = value.partition(";base64,")
    encoded = rest if separator and head.startswith(DATA_URL) else value
    try:
        data = b64decode("".join(encoded.split()), validate=True)
    except ValueError:
        raise ValueError("'image' is no base64: send a PNG or JPEG in base64") from None
    check_image(data)
    return data


ImageMember = Annotated[
    bytes,
    BeforeValidator(image_bytes),
    WithJsonSchema(
        {
            "type": "string",
            "contentEncoding": "base64",
            "description": "A crop of one thing instead of a text: PNG or JPEG in base64, 16 to "
            f"4096 pixels a side, at most {MAX_IMAGE_BYTES // 1024} kB.",
        }
    ),
]


ObjectName = Annotated[
    StrictStr,
    AfterValidator(check_text),
    Field(description=f"An object in plain words, at most {MAX_TEXT_CHARS} characters."),
]


Coordinate = Annotated[
    float,
    Field(strict=True, allow_inf_nan=False, ge=-MAX_COORDINATE_M, le=MAX_COORDINATE_M),
]
Place = tuple[Coordinate, Coordinate]


Limit = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0, le=1e6)]


IMAGE_NAME = "image"  # stands for the text in the answer to an image

# 32 x 32 pixels of two colour ramps, as an example of an image.
EXAMPLE_PNG = (
    "iVBORw0KGgoAAAANSUhEUgAAACAAAAAgCAIAAAD8GO2jAAAAOElEQVRIx2NkcGCAAwUG6rOZGGgMhr4FLKghNhpEo3EwGgej"
    "QTQaB6NxMBpEo3EwGgejQTRgFgAAqiwCTtKo1wsAAAAASUVORK5CYII="
)


class RequestModel(BaseModel):
    """Base of everything a client sends: unknown fields are refused."""

    model_config = ConfigDict(extra="forbid")


def exactly_one_of(*names: str) -> list[JsonValue]:
    """``oneOf`` of a schema whose members of these names are null unless given."""
    return [{"required": [name], "properties": {name: {"not": {"type": "null"}}}} for name in names]


class QueryRequest(RequestModel):
    """Where is it? Exactly one of ``text``, ``texts`` and ``image``."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": exactly_one_of("text", "texts", "image"),
            "examples": [
                {"text": "sofa"},
                {"texts": ["sofa", "armchair"], "area_m": [0, -2, 4, 3]},
                {"text": "table", "negatives": ["coffee table", "desk"], "max_regions": 3},
            ],
        }
    )

    text: ObjectName | None = None
    texts: Annotated[list[ObjectName], Field(min_length=1, max_length=MAX_OBJECTS)] | None = Field(
        default=None, description="Several: then the reply has a list, `answers`."
    )
    negatives: Annotated[list[ObjectName], Field(max_length=MAX_NEGATIVES)] = Field(
        default=[], description="What it must not be: these texts compete with each text."
    )
    area_m: tuple[Coordinate, Coordinate, Coordinate, Coordinate] | None = Field(
        default=None,
        description="x_min, y_min, x_max, y_max in metres: only this part of the map counts.",
    )
    max_regions: int = Field(default=5, ge=1, le=100, description="Best regions to return.")
    include_grid: bool = Field(default=False, description="Also return the score of every cell.")
    image: ImageMember | None = Field(
        default=None, description="A crop of one thing; then `score` is no probability."
    )

    @model_validator(mode="after")
    def _answerable(self) -> QueryRequest:
        if sum(given is not None for given in (self.text, self.texts, self.image)) != 1:
            raise ValueError(
                "give exactly one of 'text', an object in plain words, 'texts', a list of them, "
                'and \'image\', a PNG or JPEG in base64; for example {"text": "sofa"}'
            )
        if self.image is not None and self.negatives:
            raise ValueError("'negatives' are for texts: they do not compete with an image")
        if self.area_m is not None:
            x_min, y_min, x_max, y_max = self.area_m
            if x_min >= x_max or y_min >= y_max:
                raise ValueError(
                    f"'area_m' is {list(self.area_m)}: x_min < x_max and y_min < y_max must hold"
                )
        return self

    def requests(
        self, robot_xy_m: tuple[float, ...]
    ) -> list[SimilarityRequest | ImageSimilarityRequest]:
        """The mapper's requests, one for each text, or for the image."""
        texts = self.texts or [IMAGE_NAME if self.text is None else self.text]
        queries = [
            SimilarityRequest(
                text,
                self.max_regions,
                self.include_grid,
                negatives=tuple(self.negatives),
                area_m=self.area_m or (),
                robot_xy_m=robot_xy_m,
            )
            for text in texts
        ]
        if self.image is not None:
            return [ImageSimilarityRequest(self.image, queries[0])]
        return [*queries]


class StandingRequest(QueryRequest):
    """A query whose answers are sent again whenever they change; a stream has no grid."""

    @model_validator(mode="after")
    def _without_grid(self) -> StandingRequest:
        if self.include_grid:
            raise ValueError(
                "'include_grid' is for POST /v1/queries: a stream sends regions only; leave it out"
            )
        return self


class ComparedImage(RequestModel):
    """What the cells of the map are compared with."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"image": EXAMPLE_PNG}]})

    image: ImageMember


class SearchStart(RequestModel):
    """What the robot is to do: exactly one of these.

    ``objects``: find them, one after the other; ``object``: find a single one; ``go_to_m``: drive
    to a place; ``look_at_m``: drive to where a place can be seen, and face it. With ``order``
    ``any``, the objects are sought in the cheapest order, revised as the map grows.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": exactly_one_of("objects", "object", "go_to_m", "look_at_m"),
            "examples": [
                {"objects": ["sofa", "teddy bear", "kettle"]},
                {"objects": ["sofa", "teddy bear", "kettle"], "order": "any"},
                {"object": "sofa"},
                {"go_to_m": [2.5, -1.0]},
                {"look_at_m": [2.5, -1.0]},
            ],
        }
    )

    objects: Annotated[list[ObjectName], Field(min_length=1, max_length=MAX_OBJECTS)] | None = None
    object: ObjectName | None = None
    go_to_m: Place | None = Field(default=None, description="x, y in the map frame, metres.")
    look_at_m: Place | None = Field(default=None, description="x, y in the map frame, metres.")
    order: SearchOrder = Field(
        default=SearchOrder.GIVEN,
        description="Of the objects: as given, or the cheapest by what the map shows.",
    )
    max_distance_m: Limit | None = Field(
        default=None,
        description="Metres that the robot may drive; then the search fails as distance_limit.",
    )
    max_time_s: Limit | None = Field(
        default=None, description="Seconds that it may take; then it fails as time_limit."
    )

    @model_validator(mode="after")
    def _exactly_one(self) -> SearchStart:
        members = (self.objects, self.object, self.go_to_m, self.look_at_m)
        if sum(member is not None for member in members) != 1:
            raise ValueError(
                "give exactly one of 'objects', a list, 'object', a text, 'go_to_m' and "
                '\'look_at_m\', both [x, y] in metres; for example {"objects": ["sofa"]}'
            )
        if self.order is not SearchOrder.GIVEN and not self.names:
            raise ValueError("'order' is for objects; a place has none: leave it out")
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """What to find, in order; empty for a place."""
        return tuple(self.objects or ()) if self.object is None else (self.object,)

    def request(self, patience_s: float) -> SearchRequest:
        """The planner's request; ``patience_s``: seconds that the client waits for its reply."""
        kind, place_m = SearchKind.FIND, self.go_to_m or self.look_at_m or ()
        if place_m:
            kind = SearchKind.LOOK_AT if self.go_to_m is None else SearchKind.GO_TO
        return SearchRequest(
            self.names,
            patience_s,
            kind,
            place_m,
            order=self.order,
            max_distance_m=self.max_distance_m or 0.0,
            max_time_s=self.max_time_s or 0.0,
        )


class MergeRequest(RequestModel):
    """Where the frame of a saved map lies in that of the map in use: turned, then moved."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{}, {"x_m": 1.5, "y_m": -2.0, "yaw_rad": 1.5708}]}
    )

    x_m: Coordinate = Field(default=0.0, description="Metres that it is moved along x.")
    y_m: Coordinate = Field(default=0.0, description="Metres that it is moved along y.")
    yaw_rad: Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-10, le=10)] = Field(
        default=0.0, description="Radians that it is turned, counter-clockwise."
    )
