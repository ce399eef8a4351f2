"""The topics that Foxglove is given, each with its type; numbers for plots are JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from foxglove import Channel, Context, start_server
from foxglove import messages as fox
from foxglove.websocket import Capability, Parameter, ServerListener

from onemap_shared.services import SERVICES

TRANSFORMS = "/tf"
IMAGE, CALIBRATION = "/camera/image", "/camera/calibration"
POINTS, BOXES, DETECTED = "/camera/points", "/camera/boxes", "/detections/points"
OCCUPANCY, BELIEF, SIMILARITY = "/map/occupancy", "/map/belief", "/map/similarity"
MAP_LAYERS = (OCCUPANCY, BELIEF, SIMILARITY)
OBJECTS, PLAN, ROBOT, LOG = "/map/objects", "/plan", "/robot", "/log"
MOTION, COMMAND, MAP_STATE, SEARCH = "/motion", "/command", "/map/state", "/search"

TYPED: Mapping[str, Any] = {
    TRANSFORMS: fox.FrameTransforms,
    IMAGE: fox.CompressedImage,
    CALIBRATION: fox.CameraCalibration,
    POINTS: fox.PointCloud,
    BOXES: fox.ImageAnnotations,
    DETECTED: fox.PointCloud,
    **dict.fromkeys(MAP_LAYERS, fox.Grid),
    **dict.fromkeys((OBJECTS, PLAN, ROBOT), fox.SceneUpdate),
    LOG: fox.Log,
}


def service_topic(service: str) -> str:
    """Where the heartbeats of a service go."""
    return f"/services/{service}"


# Fields of the JSON messages with their types in JSON Schema.
HEALTH = {"ready": "boolean", "problem": "string", "metrics": "object"}
SPEED = {"linear_mps": "number", "angular_radps": "number"}
JSON: Mapping[str, Mapping[str, str]] = {
    MOTION: SPEED,
    COMMAND: SPEED,
    MAP_STATE: {
        **dict.fromkeys(("revision", "frames_fused", "cells_observed"), "integer"),
        **dict.fromkeys(("update_ms", "rate_hz", "age_s"), "number"),
    },
    SEARCH: {
        **dict.fromkeys(("search_id", "state", "target", "reason"), "string"),
        "found": "integer",
        "path_length_m": "number",
    },
    **{service_topic(name): HEALTH for name in SERVICES},
}


def json_schema(topic: str) -> dict[str, Any]:
    """The schema of a topic of ``JSON``."""
    properties = {name: {"type": kind} for name, kind in JSON[topic].items()}
    return {"type": "object", "title": topic.strip("/").replace("/", "_"), "properties": properties}


QUERY = "query"  # the one parameter: the text whose similarity is shown
MAX_QUERY_CHARS = 200
BACKLOG = 64  # messages for a slow viewer: 3 s; then the oldest go


class FoxgloveServer:
    """Offers all topics; nothing that a viewer sends changes more than ``query``."""

    def __init__(self, host: str, port: int, query: str) -> None:
        context = self._context = Context()  # its channels close when it is collected
        self._listener = _Parameters(query)
        self._channels = {
            topic: Channel(
                topic, schema=kind.get_schema(), message_encoding="protobuf", context=context
            )
            for topic, kind in TYPED.items()
        }
        for topic in JSON:
            self._channels[topic] = Channel(topic, schema=json_schema(topic), context=context)
        self._server = start_server(
            name="OneMap",
            host=host,
            port=port,
            capabilities=[Capability.Parameters],
            server_listener=self._listener,
            context=context,
            message_backlog_size=BACKLOG,
        )

    @property
    def port(self) -> int:
        """Where it listens."""
        return self._server.port

    @property
    def query(self) -> str:
        """The text that the viewers ask for; empty: that of the search."""
        return self._listener.query

    def wanted(self, topic: str) -> bool:
        """Whether a viewer has subscribed to this topic."""
        return self._channels[topic].has_sinks()

    def send(self, topic: str, message: Any, now_ns: int) -> None:
        """Send a message of the type of the topic, or a dict where that is JSON."""
        data = message if isinstance(message, dict) else message.encode()
        self._channels[topic].log(data, log_time=now_ns)

    def close(self) -> None:
        """Stop the server and its connections."""
        self._server.stop()


class _Parameters(ServerListener):
    """Holds the query; called from the server's threads."""

    def __init__(self, query: str) -> None:
        self.query = query

    def on_get_parameters(self, *_: Any) -> list[Parameter]:
        return [Parameter(QUERY, value=self.query)]

    def on_set_parameters(
        self, _client: Any, parameters: list[Parameter], *_: Any
    ) -> list[Parameter]:
        for parameter in parameters:
            value = parameter.get_value()
            if parameter.name == QUERY and isinstance(value, str):
                self.query = value.strip()[:MAX_QUERY_CHARS]
        return self.on_get_parameters()
