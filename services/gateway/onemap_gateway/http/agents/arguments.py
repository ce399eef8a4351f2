"""What agents send to a tool."""

from __future__ import annotations

from pydantic import ConfigDict, Field

from onemap_gateway.http.schemas import Limit, ObjectName, RequestModel
from onemap_shared.messages import MAX_OBJECTS, SearchOrder


class NoArguments(RequestModel):
    """A tool that needs nothing."""

    model_config = ConfigDict(json_schema_extra={"examples": [{}]})


class PlacesArguments(RequestModel):
    """Where is it?"""

    model_config = ConfigDict(json_schema_extra={"examples": [{"object": "sofa"}]})

    object: ObjectName
    max_places: int = Field(default=5, ge=1, le=20, description="Likely places to return.")


class MapArguments(RequestModel):
    """What is known of the flat?"""

    model_config = ConfigDict(json_schema_extra={"examples": [{"picture": True}]})

    picture: bool = Field(default=False, description="Also return the map as an image.")


class SeenObjectArguments(RequestModel):
    """Which object to show."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"object": "bed"}]})

    object: ObjectName = Field(description="Its name, or its id as 'list_objects' gives it.")


class AgentSearchArguments(RequestModel):
    """What to find, and what that may cost at most."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"objects": ["sofa", "kettle"], "max_distance_m": 40, "max_time_s": 300}]
        }
    )

    objects: list[ObjectName] = Field(
        min_length=1, max_length=MAX_OBJECTS, description="What to find, in plain words."
    )
    max_distance_m: Limit = Field(description="Metres that the robot may drive for all of it.")
    max_time_s: Limit = Field(description="Seconds that all of it may take.")
    order: SearchOrder = Field(
        default=SearchOrder.GIVEN, description="Find them in this order, or in the cheapest."
    )


class WhichSearchArguments(RequestModel):
    """Which search is meant."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"search_id": ""}]})

    search_id: str = Field(
        default="", pattern=r"^[A-Za-z0-9_-]{0,64}$", description="Empty: the newest search."
    )
