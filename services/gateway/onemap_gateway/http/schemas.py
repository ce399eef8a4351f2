"""What clients send over HTTP, with examples for the documentation."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StrictStr, model_validator

from onemap_shared.messages import MAX_OBJECTS, MAX_TEXT_CHARS, check_text

ObjectName = Annotated[
    StrictStr,
    AfterValidator(check_text),
    Field(description=f"An object in plain words, at most {MAX_TEXT_CHARS} characters."),
]


class RequestModel(BaseModel):
    """Base of everything a client sends: unknown fields are refused."""

    model_config = ConfigDict(extra="forbid")


class QueryRequest(RequestModel):
    """Where is it?"""

    model_config = ConfigDict(json_schema_extra={"examples": [{"text": "sofa"}]})

    text: ObjectName
    max_regions: int = Field(default=5, ge=1, le=100, description="Best regions to return.")
    include_grid: bool = Field(default=False, description="Also return the score of every cell.")


class SearchStart(RequestModel):
    """Go and find: ``objects``, one after the other, or a single ``object``."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"objects": ["sofa", "teddy bear", "kettle"]}, {"object": "sofa"}]
        }
    )

    objects: Annotated[list[ObjectName], Field(min_length=1, max_length=MAX_OBJECTS)] | None = None
    object: ObjectName | None = None

    @model_validator(mode="after")
    def _one_of_both(self) -> SearchStart:
        if (self.objects is None) == (self.object is None):
            raise ValueError(
                "name what to find, either as 'objects', a list, or as 'object', a text; "
                'for example {"objects": ["sofa"]}'
            )
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """What to find, in order."""
        return tuple(self.objects or ()) if self.object is None else (self.object,)


MAP_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


def check_map_name(name: str) -> str:
    """Return ``name``, or raise ValueError with what a name may be."""
    if not MAP_NAME.fullmatch(name):
        raise ValueError(
            "the name of a map begins with a letter or a digit and consists of at most 64 letters "
            "(A-Z, a-z), digits, '.', '_' and '-'; no folder"
        )
    return name


class MapName(RequestModel):
    """The name of a map file in the mapper's map folder."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"name": "flat"}]})

    name: Annotated[StrictStr, AfterValidator(check_map_name)] = Field(
        description="Begins with a letter or a digit; letters A-Z and a-z, digits, '.', '_' and "
        "'-', at most 64; no folder.",
        json_schema_extra={"pattern": f"^{MAP_NAME.pattern}$"},
    )
