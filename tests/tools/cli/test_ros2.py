from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from onemap_ros2 import discovery
from onemap_ros2.topic_list import TopicReport
from onemap_tools.cli.app import app

ODOM = TopicReport("/odom", "nav_msgs/msg/Odometry", 1, 2, 19.96, "odometry")
OTHER = TopicReport("/chatter", "std_msgs/msg/String", 0, 1, None, "")


@pytest.mark.parametrize(("missing", "code"), [([], 0), (["no node publishes /a"], 1)])
def test_topics_are_listed(monkeypatch: pytest.MonkeyPatch, missing: list[str], code: int) -> None:
    monkeypatch.setattr(discovery, "survey", lambda *_: ([ODOM, OTHER], missing))
    plain = CliRunner().invoke(app, ["ros2", "topics"])
    assert plain.exit_code == code
    assert "20.0 Hz  <- odometry" in plain.stdout
    assert ("missing: no node publishes /a" in plain.stdout) == bool(missing)
    as_json = CliRunner().invoke(app, ["ros2", "topics", "--json"])
    document = json.loads(as_json.stdout.splitlines()[-1])
    assert document["missing"] == missing
    assert document["topics"][0]["rate_hz"] == 19.96


def test_a_robot_that_cannot_be_reached_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise ConnectionError("no ROS 2 router answers at tcp/r")

    monkeypatch.setattr(discovery, "survey", refuse)
    result = CliRunner().invoke(app, ["ros2", "topics"])
    assert result.exit_code == 1
    assert result.stderr.strip() == "no ROS 2 router answers at tcp/r."
