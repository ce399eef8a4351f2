"""The topics that Foxglove is given, each with its type; numbers for plots are JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from foxglove import Channel, Context, start_server
from foxglove.messages import (
    CameraCalibration,
    CompressedImage,
    FrameTransforms,
    Grid,
    ImageAnnotations,
    Log,
    LogLevel,
    PointCloud,
    SceneUpdate,
)
from foxglove.websocket import Capability, Client, Parameter, ServerListener

from onemap_shared.messages import (
    Heartbeat,
    MapRevision,
    Odometry,
    SearchStatus,
    VelocityCommand,
)
from onemap_shared.services import SERVICES
from onemap_tools.recording.foxglove import timestamp

TRANSFORMS = "/tf"
IMAGE, CALIBRATION = "/camera/image", "/camera/calibration"
POINTS, BOXES, DETECTED = "/camera/points", "/camera/boxes", "/detections/points"
OCCUPANCY, BELIEF, SIMILARITY = "/map/occupancy", "/map/belief", "/map/similarity"
MAP_LAYERS = (OCCUPANCY, BELIEF, SIMILARITY)
OBJECTS, PLAN, ROBOT, LOG = "/map/objects", "/plan", "/robot", "/log"
MOTION, COMMAND, MAP_STATE, SEARCH = "/motion", "/command", "/map/state", "/search"

TYPED: Mapping[str, Any] = {
    TRANSFORMS: FrameTransforms,
    IMAGE: CompressedImage,
    CALIBRATION: CameraCalibration,
    POINTS: PointCloud,
    BOXES: ImageAnnotations,
    DETECTED: PointCloud,
    OCCUPANCY: Grid,
    BELIEF: Grid,
    SIMILARITY: Grid,
    OBJECTS: SceneUpdate,
    PLAN: SceneUpdate,
    ROBOT: SceneUpdate,
    LOG: Log,
}
SPEED = {"linear_mps": "number", "angular_radps": "number"}


def service_topic(service: str) -> str:
    """Where the heartbeats of a service go."""
    return f"/services/{service}"


# Fields of the JSON messages with their types in JSON Schema.
JSON: Mapping[str, Mapping[str, str]] = {
    MOTION: SPEED,
    COMMAND: SPEED,
    MAP_STATE: {
        "revision": "integer",
        "frames_fused": "integer",
        "cells_observed": "integer",
        "update_ms": "number",
        "rate_hz": "number",
        "age_s": "number",
    },
    SEARCH: {
        "search_id": "string",
        "state": "string",
        "target": "string",
        "reason": "string",
        "found": "integer",
        "path_length_m": "number",
    },
    **{
        service_topic(name): {"ready": "boolean", "problem": "string", "metrics": "object"}
        for name in SERVICES
    },
}


def json_schema(topic: str) -> dict[str, Any]:
    """The schema of a topic of ``JSON``."""
    properties = {name: {"type": kind} for name, kind in JSON[topic].items()}
    return {"type": "object", "title": topic.strip("/").replace("/", "_"), "properties": properties}


def speed(message: Odometry | VelocityCommand) -> dict[str, Any]:
    """What ``MOTION`` and ``COMMAND`` show."""
    return {"linear_mps": message.linear_mps, "angular_radps": message.angular_radps}


def map_state(revision: MapRevision, now_ns: int) -> dict[str, Any]:
    """What ``MAP_STATE`` shows; the age compares the robot's clock with this machine's."""
    values = {name: getattr(revision, name) for name in JSON[MAP_STATE] if name != "age_s"}
    return values | {"age_s": max(now_ns - revision.stamp_ns, 0) / 1e9}


def search_state(status: SearchStatus) -> dict[str, Any]:
    """What ``SEARCH`` shows."""
    return {
        "search_id": status.search_id,
        "state": str(status.state),
        "target": status.target,
        "reason": status.reason,
        "found": sum(bool(result.position_m) for result in status.results),
        "path_length_m": status.path_length_m,
    }


def service_state(beat: Heartbeat) -> dict[str, Any]:
    """What the topic of a service shows."""
    return {"ready": beat.ready, "problem": beat.problem, "metrics": dict(beat.metrics)}


def log_line(name: str, text: str, stamp_ns: int, *, problem: bool = False) -> Log:
    """A line of ``LOG``."""
    level = LogLevel.Warning if problem else LogLevel.Info
    return Log(timestamp=timestamp(stamp_ns), level=level, message=text, name=name)


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

    def on_get_parameters(
        self,
        client: Client,  # noqa: ARG002
        param_names: list[str],  # noqa: ARG002
        request_id: str | None = None,  # noqa: ARG002
    ) -> list[Parameter]:
        return [Parameter(QUERY, value=self.query)]

    def on_set_parameters(
        self,
        client: Client,  # noqa: ARG002
        parameters: list[Parameter],
        request_id: str | None = None,  # noqa: ARG002
    ) -> list[Parameter]:
        for parameter in parameters:
            value = parameter.get_value()
            if parameter.name == QUERY and isinstance(value, str):
                self.query = value.strip()[:MAX_QUERY_CHARS]
        return [Parameter(QUERY, value=self.query)]
