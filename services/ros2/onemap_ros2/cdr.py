"""ROS 2 messages, their types and their bytes (CDR), by rosbags: no ROS 2 is needed.

The definitions are those of Jazzy. What the adapter uses has had the same layout from Jazzy on;
type hashes are checked where a robot announces its own. rosbags lacks nav2's
action, whose types are generated as rosidl does it, and all services.
"""

from __future__ import annotations

import math
import struct
from functools import cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from onemap_ros2.config import COMPRESSED, COMPRESSED_DEPTH

IMAGE = "sensor_msgs/msg/Image"
COMPRESSED_IMAGE = "sensor_msgs/msg/CompressedImage"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
ODOMETRY = "nav_msgs/msg/Odometry"
TF = "tf2_msgs/msg/TFMessage"
CLOCK = "rosgraph_msgs/msg/Clock"
TWIST, TWIST_STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
POSE_STAMPED = "geometry_msgs/msg/PoseStamped"
NAVIGATE = "nav2_msgs/action/NavigateToPose"
GRID = "nav_msgs/msg/OccupancyGrid"
FILTER_INFO = "nav2_msgs/msg/CostmapFilterInfo"
PATH = "nav_msgs/msg/Path"
MARKER_ARRAY = "visualization_msgs/msg/MarkerArray"
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
STRING = "std_msgs/msg/String"
TRIGGER = "std_srvs/srv/Trigger"


def image_type(topic: str) -> str:
    """The type of an image topic, by the name that image_transport gives it."""
    return COMPRESSED_IMAGE if topic.endswith((COMPRESSED, COMPRESSED_DEPTH)) else IMAGE


BASES = {"bool", "uint8", "int8", "int16", "uint16", "float32", "float64", "string"}
UUID, TIME = "unique_identifier_msgs/msg/UUID", "builtin_interfaces/msg/Time"
DURATION, GOAL_INFO = "builtin_interfaces/msg/Duration", "action_msgs/msg/GoalInfo"
POSE, POINT = "geometry_msgs/msg/Pose", "geometry_msgs/msg/Point"
HEADER = "std_msgs/msg/Header"
SERVICE_EVENT = "service_msgs/msg/ServiceEventInfo"
SEND_GOAL, GET_RESULT = f"{NAVIGATE}_SendGoal", f"{NAVIGATE}_GetResult"
CANCEL_GOAL = "action_msgs/srv/CancelGoal"
FEEDBACK = f"{NAVIGATE}_FeedbackMessage"
Fields = dict[str, str]  # names to types; [] a sequence, [<=1] a bounded one

MESSAGES: dict[str, Fields] = {
    FILTER_INFO: {
        "header": HEADER,
        "type": "uint8",
        "filter_mask_topic": "string",
        "base": "float32",
        "multiplier": "float32",
    },
    f"{NAVIGATE}_Goal": {"pose": POSE_STAMPED, "behavior_tree": "string"},
    f"{NAVIGATE}_Result": {"error_code": "uint16", "error_msg": "string"},
    f"{NAVIGATE}_Feedback": {
        "current_pose": POSE_STAMPED,
        "navigation_time": DURATION,
        "estimated_time_remaining": DURATION,
        "number_of_recoveries": "int16",
        "distance_remaining": "float32",
    },
    FEEDBACK: {"goal_id": UUID, "feedback": f"{NAVIGATE}_Feedback"},
    f"{SEND_GOAL}_Request": {"goal_id": UUID, "goal": f"{NAVIGATE}_Goal"},
    f"{SEND_GOAL}_Response": {"accepted": "bool", "stamp": TIME},
    f"{GET_RESULT}_Request": {"goal_id": UUID},
    f"{GET_RESULT}_Response": {"status": "int8", "result": f"{NAVIGATE}_Result"},
    f"{CANCEL_GOAL}_Request": {"goal_info": GOAL_INFO},
    f"{CANCEL_GOAL}_Response": {"return_code": "int8", "goals_canceling": f"{GOAL_INFO}[]"},
    f"{TRIGGER}_Request": {"structure_needs_at_least_one_member": "uint8"},  # rosidl's: it is empty
    f"{TRIGGER}_Response": {"success": "bool", "message": "string"},
}


def _register_missing(store: Typestore) -> None:
    """Add the definitions to rosbags' own.

    Of a service, it and its event, which nobody sends, but which its hash is made of; rosidl maps
    the event's char to uint8.
    """
    store.register({name: ([], _described(fields)) for name, fields in MESSAGES.items()})
    constants, fields = store.fielddefs[SERVICE_EVENT]
    gid = (Nodetype.ARRAY, ((Nodetype.BASE, ("uint8", 0)), 16))
    corrected: Any = [(name, gid if name == "client_gid" else kind) for name, kind in fields]
    store.fielddefs[SERVICE_EVENT] = (constants, corrected)
    for service in (SEND_GOAL, GET_RESULT, CANCEL_GOAL, TRIGGER):
        request, response, event = (f"{service}_{end}" for end in ("Request", "Response", "Event"))
        both = {"request": f"{request}[<=1]", "response": f"{response}[<=1]"}
        store.fielddefs[event] = ([], _described({"info": SERVICE_EVENT, **both}))
        whole = {"request_message": request, "response_message": response, "event_message": event}
        store.fielddefs[service] = ([], _described(whole))


def _described(fields: Fields) -> Any:
    """The fields as rosbags wants them."""
    return [(name, _node(kind)) for name, kind in fields.items()]


def _node(kind: str) -> Any:
    for mark, limit in (("[]", 0), ("[<=1]", 1)):
        if kind.endswith(mark):
            return (Nodetype.SEQUENCE, (_node(kind.removesuffix(mark)), limit))
    return (Nodetype.BASE, (kind, 0)) if kind in BASES else (Nodetype.NAME, kind)


NS = 1_000_000_000


class FormatError(ValueError):
    """Bytes or fields from the robot that cannot be what they claim to be; one sentence."""


@cache
def store() -> Typestore:
    """The message definitions; made on first use, which takes 0.3 s."""
    made = get_typestore(Stores.ROS2_JAZZY)
    _register_missing(made)
    return made


def known(ros_type: str) -> bool:
    """Whether the definition of ``ros_type`` (``pkg/msg/Type``) is here."""
    return ros_type in store().fielddefs


def type_hash(ros_type: str) -> str:
    """The hash of the definition, ``RIHS01_`` and 64 hexadecimal digits."""
    return store().hash_rihs01(ros_type)


def new(ros_type: str, *fields: Any) -> Any:
    """A message with these fields, in the order of its definition."""
    return store().types[ros_type](*fields)


def encode(message: Any, ros_type: str) -> bytes:
    """The message as CDR, little-endian, with its header of four bytes."""
    return bytes(store().serialize_cdr(message, ros_type))


def decode(data: bytes, ros_type: str) -> Any:
    """The message; its arrays are read-only views of ``data``. FormatError if it is none."""
    try:
        return store().deserialize_cdr(memoryview(data), ros_type)  # a slice of bytes is a copy
    except (SerdeError, ValueError) as problem:
        raise FormatError(f"{len(data)} bytes are no {ros_type}: {problem}") from problem


def decode_start(data: bytes, ros_type: str) -> Any:
    """The message at the start of ``data``; later releases append fields to some messages."""
    try:
        _check_header(data, 4)
        layout = store().get_msgdef(ros_type)
        read = layout.deserialize_cdr_le if data[1] else layout.deserialize_cdr_be
        return read(data[4:], 0, layout.cls, store())[0]
    except (SerdeError, ValueError, struct.error) as problem:
        raise FormatError(f"{len(data)} bytes are no {ros_type}: {problem}") from problem


def stamp_ns(stamp: Any) -> int:
    """A ``builtin_interfaces/Time`` in nanoseconds."""
    return int(stamp.sec) * NS + int(stamp.nanosec)


def time_of(stamp: int) -> Any:
    """Nanoseconds as ``builtin_interfaces/Time``."""
    return new("builtin_interfaces/msg/Time", stamp // NS, stamp % NS)


def header(stamp: int, frame: str) -> Any:
    """A ``std_msgs/Header`` with the stamp in nanoseconds."""
    return new("std_msgs/msg/Header", time_of(stamp), frame)


def pose(x_m: float, y_m: float, z_m: float = 0.0, yaw_rad: float = 0.0) -> Any:
    """A ``geometry_msgs/Pose`` that stands upright."""
    turn = 0.0, 0.0, math.sin(0.5 * yaw_rad), math.cos(0.5 * yaw_rad)
    return new(POSE, new(POINT, x_m, y_m, z_m), new("geometry_msgs/msg/Quaternion", *turn))


def peek_stamp_ns(data: bytes, start: int = 4) -> int:
    """The stamp at byte ``start`` of a message, without decoding the rest; 4: of its header."""
    _check_header(data, start + 8)
    seconds, nanoseconds = struct.unpack_from("<iI" if data[1] else ">iI", data, start)
    return int(seconds) * NS + int(nanoseconds)


def _check_header(data: bytes, length: int) -> None:
    if len(data) < length or data[0] != 0 or data[1] not in (0, 1):
        raise FormatError(f"{len(data)} bytes do not begin with a CDR header and what follows it")
