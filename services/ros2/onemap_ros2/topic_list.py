"""Which topics a robot must have as it is configured, and which are missing."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

from onemap_ros2 import cdr
from onemap_ros2.config import Ros2Config, TopicParams
from onemap_ros2.network.interface import (
    ACTION_SERVER,
    PUBLISHER,
    SEND_GOAL,
    SERVER,
    SUBSCRIBER,
    Endpoint,
)

VERBS = {PUBLISHER: "publishes", SUBSCRIBER: "subscribes to", SERVER: "serves"}


class TopicNeed(NamedTuple):
    """A topic that the configuration asks of the robot.

    setting: its key below ``ros2.topics``. types: that it may have. kind: what the robot's node
    is to it: publisher, subscriber or server.
    """

    setting: str
    topic: str
    types: tuple[str, ...]
    kind: str = PUBLISHER


def needs(config: Ros2Config) -> list[TopicNeed]:
    """What the robot must have, as it is configured."""
    topics = config.names
    wanted = [
        TopicNeed("tf_static", topics.tf_static, (cdr.TF,)),
        TopicNeed("tf", topics.tf, (cdr.TF,)),
        TopicNeed("camera_info", topics.camera_info, (cdr.CAMERA_INFO,)),
        TopicNeed("odometry", topics.odometry, (cdr.ODOMETRY,)),
        TopicNeed("color", topics.color, (cdr.image_type(topics.color),)),
        TopicNeed("depth", topics.depth, (cdr.image_type(topics.depth),)),
    ]
    if config.use_sim_time:
        wanted.append(TopicNeed("clock", topics.clock, (cdr.CLOCK,)))
    if config.drive == "velocity":
        types = (cdr.TWIST, cdr.TWIST_STAMPED)
        wanted.append(TopicNeed("command", topics.command, types, SUBSCRIBER))
    else:
        wanted.append(TopicNeed("navigate", topics.navigate, (cdr.NAVIGATE,), SERVER))
    return wanted


def missing(endpoints: Iterable[Endpoint], config: Ros2Config) -> dict[str, str]:
    """A sentence for every configured topic that the robot lacks, by its setting."""
    known = [_as_action(each) for each in endpoints]
    found = {}
    for need in needs(config):
        sentence = _lack(need, [each for each in known if each.kind == need.kind])
        if sentence:
            set_by = f" (ros2.topics.{need.setting})"
            what = need.topic + set_by * (need.setting in TopicParams.model_fields)
            found[need.setting] = f"no node {VERBS[need.kind]} {what}: {sentence}"
    return found


def serves_action(endpoints: Iterable[Endpoint], action: str) -> bool:
    """Whether a node serves this action."""
    return any(each.kind == SERVER and each.topic == action for each in map(_as_action, endpoints))


def _as_action(endpoint: Endpoint) -> Endpoint:
    """The service with which an action's goals are sent, as the action itself."""
    if endpoint.kind == ACTION_SERVER:
        return replace(endpoint, kind=SERVER)
    if endpoint.kind != SERVER or not endpoint.topic.endswith(SEND_GOAL):
        return endpoint
    action = endpoint.topic.removesuffix(SEND_GOAL)
    return replace(endpoint, topic=action, ros_type=endpoint.ros_type.removesuffix("_SendGoal"))


def _lack(need: TopicNeed, endpoints: list[Endpoint]) -> str:
    here = sorted({each.ros_type for each in endpoints if each.topic == need.topic})
    wanted = " or ".join(need.types)
    if set(here) & set(need.types):
        return ""
    if here:
        return f"it is {', '.join(here)} and must be {wanted}"
    fitting = sorted({each.topic for each in endpoints if each.ros_type in need.types})
    near = difflib.get_close_matches(need.topic, fitting, n=1, cutoff=0.0)
    return f"the nearest of its type is {near[0]}" if near else f"there is no {wanted}"
