from __future__ import annotations

import pytest

from onemap_ros2.config import TopicParams
from onemap_ros2.rmw_keys import Endpoint
from onemap_ros2.topic_list import TYPES, missing, topic_reports

TOPICS = TopicParams(color="/camera/color")
IMAGE = "sensor_msgs/msg/Image"


def endpoint(topic: str, ros_type: str, kind: str = "MP") -> Endpoint:
    return Endpoint(kind, "/robot", topic, ros_type, "RIHS01_0")


def robot() -> list[Endpoint]:
    """One that has everything."""
    return [
        endpoint(getattr(TOPICS, name), types[-1], "MS" if name == "command" else "MP")
        for name, types in TYPES.items()
    ]


def test_a_robot_that_has_everything_lacks_nothing() -> None:
    assert missing(robot(), TOPICS) == {}


@pytest.mark.parametrize("setting", TYPES)
def test_every_missing_topic_is_named_by_its_setting(setting: str) -> None:
    name = getattr(TOPICS, setting)
    rest = [each for each in robot() if each.topic != name]
    found = missing(rest, TOPICS)
    assert list(found) == [setting]
    assert f"{name} (ros2.topics.{setting})" in found[setting]


def test_the_nearest_topic_of_the_right_type_is_named() -> None:
    rest = [each for each in robot() if each.topic != "/camera/color"]
    others = [endpoint("/front/color/image", IMAGE), endpoint("/camera/color_", "x/msg/Y")]
    sentence = missing([*rest, *others], TOPICS)["color"]
    assert sentence.endswith("the nearest of its type is /front/color/image")


def test_a_wrong_type_is_named() -> None:
    rest = [each for each in robot() if each.topic != "/odom"]
    sentence = missing([*rest, endpoint("/odom", IMAGE)], TOPICS)["odometry"]
    assert sentence.endswith("it is sensor_msgs/msg/Image and must be nav_msgs/msg/Odometry")


def test_topics_are_listed_with_counts_and_rates() -> None:
    both = [endpoint("/odom", "a/msg/B"), endpoint("/odom", "a/msg/B", "MS")]
    reports = topic_reports([*both, endpoint("/a", IMAGE)], {("/odom", "a/msg/B"): 20.0}, TOPICS)
    assert [(each.topic, each.setting) for each in reports] == [("/a", ""), ("/odom", "odometry")]
    odom = reports[1]
    assert (odom.publishers, odom.subscribers, odom.rate_hz) == (1, 1, 20.0)
    assert reports[0].rate_hz is None
