"""What a robot has, what it lacks, and how often it speaks."""

from __future__ import annotations

import itertools

import pytest

from onemap_ros2 import discovery
from onemap_ros2.cdr import IMAGE, ODOMETRY, TF
from onemap_ros2.config import Ros2Config, TopicParams
from onemap_ros2.network.interface import Endpoint
from onemap_ros2.topic_list import missing, needs
from onemap_shared.clock import SystemClock
from tests.ros2.fake_network import FakeNetwork

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


class Talking(FakeNetwork):
    """One message on /odom in every wait, once it is read."""

    def wait(self, timeout_s: float) -> None:
        if "/odom" in self.types:
            self.say("/odom", b"")


def test_a_survey_counts_messages_and_names_what_is_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    others = endpoint("/cmd_vel", "a/msg/B", "MS"), endpoint("/tf", TF), endpoint("/tf_static", TF)
    ours = endpoint("/cmd_vel", "a/msg/B")  # OneMap's own, silent while nobody searches
    network = Talking(endpoint("/odom", ODOMETRY), ours, *others)
    seconds = itertools.count(0.0, 0.1)
    monkeypatch.setattr(SystemClock, "monotonic_s", lambda _: next(seconds))
    monkeypatch.setattr(discovery, "join", lambda *_: network)
    reports, lacking = discovery.survey(CONFIG, 2.0)
    assert [each.topic for each in reports] == ["/cmd_vel", "/odom", "/tf", "/tf_static"]
    assert reports[1].rate_hz == pytest.approx(10.0, rel=0.1)
    assert any("ros2.topics.depth" in sentence for sentence in lacking)
    assert [each for each in lacking if each.startswith("no message of")] == [
        "no message of /tf came in 2 s, although a node publishes it"
    ]
    assert network.closed


def test_without_a_router_there_is_no_survey() -> None:
    with pytest.raises(ConnectionError, match="no ROS 2 router answers"):
        discovery.survey(Ros2Config(connect=("tcp/127.0.0.1:1",)), 1.0)
