"""What clients send over HTTP, with examples for the documentation."""

from __future__ import annotations

from base64 import b64decode
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

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

from onemap_shared import messages as m
from onemap_shared.geometry import MAX_COORDINATE_M
from onemap_shared.sentence import CLAUSES, COLOURS, Sentence, listed_sentences, parse, search_for

DATA_URL = "data:image/"
MAX_PHRASES = 10  # of one part: more than a sentence says


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
    m.check_image(data)
    return data


ImageMember = Annotated[
    bytes,
    BeforeValidator(image_bytes),
    WithJsonSchema(
        {
            "type": "string",
            "contentEncoding": "base64",
            "description": "A crop of one thing instead of a text: PNG or JPEG in base64, 16 to "
            f"4096 pixels a side, at most {m.MAX_IMAGE_BYTES // 1024} kB.",
        }
    ),
]


ObjectName = Annotated[
    StrictStr,
    AfterValidator(m.check_text),
    Field(description=f"An object in plain words, at most {m.MAX_TEXT_CHARS} characters."),
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


_TEXT = {"type": "string", "maxLength": m.MAX_TEXT_CHARS}
Phrases = Annotated[
    list[ObjectName],
    BeforeValidator(lambda value: [value] if isinstance(value, str) else value),
    Field(max_length=MAX_PHRASES),
    WithJsonSchema({"anyOf": [_TEXT, {"type": "array", "items": _TEXT, "maxItems": MAX_PHRASES}]}),
]


class Parts(RequestModel):
    """What is said of an object besides its name: each part instead of words of a sentence."""

    near: Phrases = Field(default=[], description="Objects that it is next to, as 'bed'.")
    on: Phrases = Field(default=[], description="Objects that it lies on, as 'table'.")
    under: Phrases = Field(default=[], description="Objects that it is under, as 'desk'.")
    between: Annotated[list[ObjectName], Field(max_length=2)] = Field(
        default=[], description="The two objects that it is between, as ['bed', 'desk']."
    )
    in_: Phrases = Field(
        default=[],
        alias="in",
        description="A place of the map or a kind of room, as 'kitchen', or a thing, as 'box'. Of "
        "several places it lies in one.",
    )
    not_in: Phrases = Field(default=[], description="Places or kinds of rooms that it is not in.")
    stay_out_of: Phrases = Field(
        default=[], description="Places of the map that the robot does not enter on this search."
    )
    negatives: Annotated[list[ObjectName], Field(max_length=m.MAX_NEGATIVES)] = Field(
        default=[],
        description="What it must not be: these compete with it, in a query with each of `texts`.",
    )
    colour: ObjectName | None = Field(
        default=None,
        description=f"One of {', '.join(COLOURS)}: checked on the map and in pictures of it.",
    )

    @property
    def parts(self) -> dict[str, list[str]]:
        """What was given, as ``parse`` takes it."""
        given = {part: getattr(self, "in_" if part == "in" else part) for part in CLAUSES}
        given["colour"] = [] if self.colour is None else [self.colour]
        return {part: phrases for part, phrases in given.items() if phrases}


class Described(Parts):
    """An object: ``text`` names it or is a sentence; what it does not say is in the parts."""

    text: ObjectName

    @model_validator(mode="after")
    def _understood(self) -> Described:
        self.sentence()
        return self

    def sentence(self, places: Collection[str] | None = None) -> Sentence:
        """What is said of it, with the places of the map; ValueError names wrong words."""
        return parse(self.text, places, self.parts)


def _each_listed(value: object) -> object:
    """The objects of a list, those that one text lists in its place: "bed, then the sofa"."""
    if not isinstance(value, list):
        return value
    return [
        name
        for each in value
        for name in (listed_sentences(each) if isinstance(each, str) else [each])
    ]


DescribedObject = Annotated[
    Described,
    BeforeValidator(lambda value: {"text": value} if isinstance(value, str) else value),
    WithJsonSchema(
        {
            "anyOf": [
                {**_TEXT, "description": "A name, or a sentence: 'the red chair near the bed'."},
                Described.model_json_schema(),
            ]
        }
    ),
]


DescribedObjects = Annotated[
    list[DescribedObject],
    Field(min_length=1, max_length=m.MAX_OBJECTS),
    BeforeValidator(_each_listed),
]


class QueryRequest(Parts):
    """Where is it? Exactly one of ``text``, ``texts`` and ``image``; parts only beside ``text``."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": exactly_one_of("text", "texts", "image"),
            "examples": [
                {"text": "sofa"},
                {"texts": ["sofa", "armchair"], "area_m": [0, -2, 4, 3]},
                {"text": "the red chair next to the bed"},
                {"text": "lamp", "near": "bed", "in": "kitchen"},
                {"text": "table", "negatives": ["coffee table", "desk"], "max_regions": 3},
            ],
        }
    )

    text: ObjectName | None = None
    texts: DescribedObjects | None = Field(
        default=None, description="Several: then the reply has a list, `answers`."
    )
    area_m: tuple[Coordinate, Coordinate, Coordinate, Coordinate] | None = Field(
        default=None,
        description="x_min, y_min, x_max, y_max in metres: only this part of the map counts.",
    )
    max_regions: int = Field(default=5, ge=1, le=100, description="Best regions to return.")
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
        shared = {"negatives"} if self.image is None else set()
        _check_parts(self, self.text, "text", "texts", but=shared)
        if self.area_m is not None:
            x_min, y_min, x_max, y_max = self.area_m
            if x_min >= x_max or y_min >= y_max:
                raise ValueError(
                    f"'area_m' is {list(self.area_m)}: x_min < x_max and y_min < y_max must hold"
                )
        return self

    @property
    def described(self) -> list[Described]:
        """What is asked for in words; nothing of an image."""
        return [
            each.model_copy(update={"negatives": [*each.negatives, *self.negatives]})
            if self.texts
            else each
            for each in _described(self, self.text, self.texts)
        ]

    def requests(
        self, robot_xy_m: tuple[float, ...], sentences: Sequence[Sentence]
    ) -> list[m.SimilarityRequest | m.ImageSimilarityRequest]:
        """The mapper's requests, one for each sentence, or for the image."""
        queries = [
            m.SimilarityRequest(
                each.name,
                self.max_regions,
                negatives=each.detail.negatives,
                area_m=self.area_m or (),
                robot_xy_m=robot_xy_m,
                detail=replace(each.detail, negatives=()),
            )
            for each in sentences or [Sentence(IMAGE_NAME)]
        ]
        if self.image is not None:
            return [m.ImageSimilarityRequest(self.image, queries[0])]
        return [*queries]


def _check_parts(
    request: Parts, single: str | None, name: str, names: str, but: Collection[str] = ()
) -> None:
    """ValueError unless parts stand beside the single object that they describe, or are none.

    but: parts that may describe several.
    """
    if single is not None:
        parse(single, parts=request.parts)
    elif parts := [part for part in request.parts if part not in but]:
        part = parts[0]
        raise ValueError(
            f"{part!r} describes a single {name!r}; of {names!r} give each as an object: "
            f'{{"text": "lamp", "{part}": ...}}'
        )


def _described(
    request: Parts, single: str | None, several: list[Described] | None
) -> list[Described]:
    if single is None:
        return several or []
    parts = request.model_dump(include={*Parts.model_fields}, by_alias=True)
    return [Described.model_validate({**parts, "text": single})]


class ComparedImage(RequestModel):
    """What the cells of the map are compared with."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"image": EXAMPLE_PNG}]})

    image: ImageMember


After = Annotated[
    Literal["stay", "return"],
    Field(
        description="What the robot does when all objects are done, found or not: it stays, or "
        "returns to where it set out, as a part of this search."
    ),
]


class SearchStart(Parts):
    """What the robot is to do: exactly one of these.

    ``objects``: find them, one after the other; ``object``: find a single one; ``go_to_m``: drive
    to a place, ``go_to``: to one by its name; ``look_at_m``: drive to where a place can be seen,
    and face it. Parts only beside ``object``.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": exactly_one_of("objects", "object", "go_to", "go_to_m", "look_at_m"),
            "examples": [
                {"objects": ["sofa", "teddy bear", "kettle"]},
                {"object": "the lamp next to the bed, stay out of the nursery"},
                {"object": "lamp", "near": "bed", "stay_out_of": ["nursery"]},
                {"objects": ["sofa", {"text": "chair", "colour": "red", "in": "kitchen"}]},
                {"object": "lamp", "after": "return"},
                {"go_to_m": [2.5, -1.0]},
                {"go_to": "back"},
                {"look_at_m": [2.5, -1.0]},
            ],
        }
    )

    objects: DescribedObjects | None = None
    object: ObjectName | None = None
    go_to_m: Place | None = Field(default=None, description="x, y in the map frame, metres.")
    go_to: ObjectName | None = Field(
        default=None,
        description="Name of a place of the map, or 'back': where the robot stood when the last "
        "search or drive was accepted.",
    )
    look_at_m: Place | None = Field(default=None, description="x, y in the map frame, metres.")
    after: After = "stay"
    max_distance_m: Limit | None = Field(
        default=None,
        description="Metres that the robot may drive; then the search fails as distance_limit.",
    )
    max_time_s: Limit | None = Field(
        default=None, description="Seconds that it may take; then it fails as time_limit."
    )

    @model_validator(mode="before")
    @classmethod
    def _without_order(cls, members: Any) -> Any:
        if isinstance(members, dict) and "order" in members:
            raise ValueError("'order' is gone: objects are sought as they are given; leave it out")
        return members

    @model_validator(mode="after")
    def _exactly_one(self) -> SearchStart:
        members = (self.objects, self.object, self.go_to_m, self.go_to, self.look_at_m)
        if sum(member is not None for member in members) != 1:
            raise ValueError(
                "give exactly one of 'objects', a list, 'object', a text, 'go_to', the name of a "
                "place, 'go_to_m' and 'look_at_m', both [x, y] in metres; for example "
                '{"objects": ["sofa"]}'
            )
        if self.after != "stay" and self.objects is None and self.object is None:
            raise ValueError("'after' is for objects: leave it out of a drive")
        _check_parts(self, self.object, "object", "objects")
        return self

    @property
    def described(self) -> list[Described]:
        """What to find, in order; nothing of a place."""
        return _described(self, self.object, self.objects)

    def request(
        self,
        patience_s: float,
        sentences: Sequence[Sentence],
        age_s: float = 0.0,
    ) -> m.SearchRequest:
        """The planner's request; ``patience_s``: seconds that the client waits for its reply;
        age_s: since the client asked."""
        kind = m.SearchKind.FIND
        if self.look_at_m is not None:
            kind = m.SearchKind.LOOK_AT
        elif self.go_to_m or self.go_to:
            kind = m.SearchKind.GO_TO
        return search_for(
            sentences,
            patience_s,
            kind=kind,
            place_m=self.go_to_m or self.look_at_m or (),
            place=self.go_to or "",
            max_distance_m=self.max_distance_m or 0.0,
            max_time_s=self.max_time_s or 0.0,
            after=m.After(self.after),
            age_s=age_s,
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
