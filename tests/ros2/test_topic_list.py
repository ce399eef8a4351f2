"""What a robot has, and what it lacks."""

from __future__ import annotations

import pytest

from onemap_ros2.cdr import IMAGE
from onemap_ros2.config import Ros2Config, TopicParams
from onemap_ros2.network.interface import Endpoint
from onemap_ros2.topic_list import missing, needs

TOPICS = TopicParams(color="/camera/color")
CONFIG = Ros2Config(topics=TOPICS)
EVERYTHING = Ros2Config(topics=TOPICS, namespace="/r1", use_sim_time=True, drive="nav2")


def endpoint(topic: str, ros_type: str, kind: str = "MP") -> Endpoint:
    return Endpoint(kind, "/robot", topic, ros_type, "RIHS01_0")


def robot(config: Ros2Config = CONFIG) -> list[Endpoint]:
    """One that has everything."""
    return [endpoint(need.topic, need.types[-1], need.kind) for need in needs(config)]


@pytest.mark.parametrize("config", [CONFIG, EVERYTHING])
def test_every_missing_topic_is_named_by_its_setting(config: Ros2Config) -> None:
    for need in needs(config):
        rest = [each for each in robot(config) if each.topic != need.topic]
        found = missing(rest, config)
        assert list(found) == [need.setting]
        set_by = f" (ros2.topics.{need.setting})" * (need.setting in TopicParams.model_fields)
        assert f"{need.topic}{set_by}: " in found[need.setting]


def test_the_namespace_stands_before_all_but_the_clock() -> None:
    named = {need.setting: need.topic for need in needs(EVERYTHING)}
    assert named["clock"] == "/clock"
    assert all(name.startswith("/r1/") for s, name in named.items() if s != "clock")
    shared = EVERYTHING.model_copy(update={"tf_in_namespace": False})
    assert shared.names.tf == "/tf"
    assert shared.names.odometry == "/r1/odom"


@pytest.mark.parametrize("color", ["/c/image_raw", "/c/image_raw/compressed"])
def test_the_camera_information_is_beside_the_image(color: str) -> None:
    assert Ros2Config(topics=TopicParams(color=color)).names.camera_info == "/c/camera_info"
    named = TopicParams(color=color, camera_info="/elsewhere")
    assert Ros2Config(topics=named, namespace="/r1").names.camera_info == "/r1/elsewhere"


@pytest.mark.parametrize(
    ("kind", "ros_type", "topic"),
    [
        ("SS", "nav2_msgs/action/NavigateToPose_SendGoal", "/_action/send_goal"),
        ("AS", "nav2_msgs/action/NavigateToPose", ""),
    ],
)
def test_the_action_of_nav2_is_looked_for(kind: str, ros_type: str, topic: str) -> None:
    config = Ros2Config(drive="nav2")
    rest = [each for each in robot(config) if each.topic != config.names.navigate]
    assert list(missing(rest, config)) == ["navigate"]
    name = f"{config.names.navigate}{topic}"
    assert missing([*rest, endpoint(name, ros_type, kind)], config) == {}
    near = missing([*rest, endpoint(f"/r2{name}", ros_type, kind)], config)["navigate"]
    assert "the nearest of its type is /r2/" in near


def test_the_nearest_topic_of_the_right_type_is_named() -> None:
    rest = [each for each in robot() if each.topic != "/camera/color"]
    others = [endpoint("/front/color/image", IMAGE), endpoint("/camera/color_", "x/msg/Y")]
    sentence = missing([*rest, *others], CONFIG)["color"]
    assert sentence.endswith("the nearest of its type is /front/color/image")
