"""What a robot publishes and hears, and which of the configured topics are missing."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from onemap_ros2.config import TopicParams
from onemap_ros2.rmw_keys import PUBLISHER, SUBSCRIBER, Endpoint

# Types that each topic of the configuration may have.
TYPES = {
    "color": ("sensor_msgs/msg/Image",),
    "depth": ("sensor_msgs/msg/Image",),
    "camera_info": ("sensor_msgs/msg/CameraInfo",),
    "odometry": ("nav_msgs/msg/Odometry",),
    "command": ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"),
    "tf": ("tf2_msgs/msg/TFMessage",),
    "tf_static": ("tf2_msgs/msg/TFMessage",),
}


@dataclass(frozen=True, slots=True)
class TopicReport:
    """One topic of the robot.

    Attributes:
        topic: its name.
        ros_type: ``pkg/msg/Type``.
        publishers: how many nodes' publishers it has.
        subscribers: how many subscribers.
        rate_hz: messages per second; None where nothing was counted.
        setting: the key below ``ros2.topics`` that names it; empty if none does.
    """

    topic: str
    ros_type: str
    publishers: int
    subscribers: int
    rate_hz: float | None
    setting: str


def topic_reports(
    endpoints: Iterable[Endpoint], rates_hz: Mapping[tuple[str, str], float], topics: TopicParams
) -> list[TopicReport]:
    """All topics by name; ``rates_hz`` by topic and type."""
    settings = {name: setting for setting, name in topics.model_dump().items()}
    kinds: dict[tuple[str, str], list[str]] = {}
    for endpoint in endpoints:
        kinds.setdefault((endpoint.topic, endpoint.ros_type), []).append(endpoint.kind)
    return [
        TopicReport(
            topic,
            ros_type,
            here.count(PUBLISHER),
            here.count(SUBSCRIBER),
            rates_hz.get((topic, ros_type)),
            settings.get(topic, ""),
        )
        for (topic, ros_type), here in sorted(kinds.items())
    ]


def missing(endpoints: Iterable[Endpoint], topics: TopicParams) -> dict[str, str]:
    """A sentence for every configured topic that the robot lacks, by its setting."""
    known = list(endpoints)
    found = {}
    for setting, types in TYPES.items():
        name = getattr(topics, setting)
        kind = SUBSCRIBER if setting == "command" else PUBLISHER
        sentence = _lack(name, types, [each for each in known if each.kind == kind])
        if sentence:
            verb = "subscribes to" if setting == "command" else "publishes"
            found[setting] = f"no node {verb} {name} (ros2.topics.{setting}): {sentence}"
    return found


def _lack(name: str, types: tuple[str, ...], endpoints: list[Endpoint]) -> str:
    here = sorted({each.ros_type for each in endpoints if each.topic == name})
    if set(here) & set(types):
        return ""
    if here:
        return f"it is {', '.join(here)} and must be {' or '.join(types)}"
    fitting = sorted({each.topic for each in endpoints if each.ros_type in types})
    near = difflib.get_close_matches(name, fitting, n=1, cutoff=0.0)
    return f"the nearest of its type is {near[0]}" if near else f"there is no {' or '.join(types)}"
