from __future__ import annotations

import itertools

import pytest

from onemap_ros2 import discovery
from onemap_ros2.config import Ros2Config
from onemap_ros2.discovery import count, survey
from onemap_ros2.network.interface import Endpoint
from tests.ros2.fake_network import FakeNetwork

ODOMETRY = "nav_msgs/msg/Odometry"


class Talking(FakeNetwork):
    """One message on /odom in every wait."""

    def wait(self, timeout_s: float) -> None:
        self.say("/odom", b"")


@pytest.fixture
def network(monkeypatch: pytest.MonkeyPatch) -> Talking:
    seconds = itertools.count(0.0, 0.1)
    monkeypatch.setattr("onemap_ros2.discovery.time.monotonic", lambda: next(seconds))
    return Talking(
        Endpoint("MP", "/robot", "/odom", ODOMETRY, "RIHS01_0"),
        Endpoint("MS", "/robot", "/cmd_vel", "geometry_msgs/msg/Twist", "RIHS01_0"),
    )


def test_counts_what_is_published(network: Talking) -> None:
    assert count(network, 2.0) == {("/odom", ODOMETRY): pytest.approx(10.0, rel=0.1)}


def test_a_survey_names_what_is_missing(network: Talking, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(discovery, "join", lambda *_: network)
    reports, missing = survey(Ros2Config(), 1.0)
    assert [each.topic for each in reports] == ["/cmd_vel", "/odom"]
    assert any("ros2.topics.depth" in sentence for sentence in missing)
    assert network.closed


def test_without_a_router_there_is_no_survey() -> None:
    with pytest.raises(ConnectionError, match="no ROS 2 router answers"):
        survey(Ros2Config(connect=("tcp/127.0.0.1:1",)), 1.0)
