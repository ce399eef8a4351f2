"""Definitions that rosbags lacks: vision_msgs 4, nav2's action, and the services of actions.

An action is three services and two topics; their types are generated from the action's goal,
result and feedback, as rosidl does it.
"""

from __future__ import annotations

from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys.store import Typestore

from onemap_ros2.ros_types import NAVIGATE

BASES = {"bool", "int8", "int16", "uint16", "float32", "float64", "string"}
UUID, TIME = "unique_identifier_msgs/msg/UUID", "builtin_interfaces/msg/Time"
DURATION, POSE = "builtin_interfaces/msg/Duration", "geometry_msgs/msg/Pose"
GOAL_INFO, STAMPED = "action_msgs/msg/GoalInfo", "geometry_msgs/msg/PoseStamped"
HEADER, VISION = "std_msgs/msg/Header", "vision_msgs/msg"
SERVICE_EVENT = "service_msgs/msg/ServiceEventInfo"
SEND_GOAL, GET_RESULT = f"{NAVIGATE}_SendGoal", f"{NAVIGATE}_GetResult"
CANCEL_GOAL = "action_msgs/srv/CancelGoal"
FEEDBACK = f"{NAVIGATE}_FeedbackMessage"
Fields = dict[str, str]  # names to types; [] a sequence, [<=1] a bounded one

MESSAGES: dict[str, Fields] = {
    f"{VISION}/ObjectHypothesis": {"class_id": "string", "score": "float64"},
    f"{VISION}/ObjectHypothesisWithPose": {
        "hypothesis": f"{VISION}/ObjectHypothesis",
        "pose": "geometry_msgs/msg/PoseWithCovariance",
    },
    f"{VISION}/BoundingBox3D": {"center": POSE, "size": "geometry_msgs/msg/Vector3"},
    f"{VISION}/Detection3D": {
        "header": HEADER,
        "results": f"{VISION}/ObjectHypothesisWithPose[]",
        "bbox": f"{VISION}/BoundingBox3D",
        "id": "string",
    },
    f"{VISION}/Detection3DArray": {"header": HEADER, "detections": f"{VISION}/Detection3D[]"},
    f"{NAVIGATE}_Goal": {"pose": STAMPED, "behavior_tree": "string"},
    f"{NAVIGATE}_Result": {"error_code": "uint16", "error_msg": "string"},
    f"{NAVIGATE}_Feedback": {
        "current_pose": STAMPED,
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
}


def register_missing(store: Typestore) -> None:
    """Add the definitions to rosbags' own."""
    store.register({name: ([], _described(fields)) for name, fields in MESSAGES.items()})
    _correct_event(store)
    for service in (SEND_GOAL, GET_RESULT, CANCEL_GOAL):
        _define_service(store, service)


def _correct_event(store: Typestore) -> None:
    """Services have events, which count for their hashes; rosidl maps their char to uint8."""
    constants, fields = store.fielddefs[SERVICE_EVENT]
    gid = (Nodetype.ARRAY, ((Nodetype.BASE, ("uint8", 0)), 16))
    corrected: Any = [(name, gid if name == "client_gid" else kind) for name, kind in fields]
    store.fielddefs[SERVICE_EVENT] = (constants, corrected)


def _define_service(store: Typestore, service: str) -> None:
    """The service itself and its event, which nobody sends, but which its hash is made of."""
    event = {
        "info": SERVICE_EVENT,
        "request": f"{service}_Request[<=1]",
        "response": f"{service}_Response[<=1]",
    }
    whole = {
        "request_message": f"{service}_Request",
        "response_message": f"{service}_Response",
        "event_message": f"{service}_Event",
    }
    store.fielddefs[f"{service}_Event"] = ([], _described(event))
    store.fielddefs[service] = ([], _described(whole))


def _described(fields: Fields) -> Any:
    """The fields as rosbags wants them."""
    return [(name, _node(kind)) for name, kind in fields.items()]


def _node(kind: str) -> Any:
    for mark, limit in (("[]", 0), ("[<=1]", 1)):
        if kind.endswith(mark):
            return (Nodetype.SEQUENCE, (_node(kind.removesuffix(mark)), limit))
    return (Nodetype.BASE, (kind, 0)) if kind in BASES else (Nodetype.NAME, kind)
