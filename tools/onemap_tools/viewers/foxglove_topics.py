"""The topics that Foxglove is given, each with its type; numbers for plots are JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

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

from onemap_shared.messages import (
    Heartbeat,
    MapRevision,
    Odometry,
    SearchStatus,
    VelocityCommand,
)
from onemap_shared.services import SERVICES
from onemap_tools.viewers.foxglove_messages import timestamp

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
