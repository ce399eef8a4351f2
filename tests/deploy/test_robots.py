"""Presets for cameras and robots: valid, complete, and honest about where they come from."""

from __future__ import annotations

from pathlib import Path

import pytest

from onemap_ros2.config import Ros2Config
from onemap_ros2.topic_list import missing, needs
from onemap_shared.config import read, section
from tests.deploy.deployment import DEPLOY, models
from tests.ros2.test_topic_list import endpoint

ROBOTS = sorted((DEPLOY / "config" / "robots").glob("*.yaml"))
PROMISED = {"realsense", "zed2", "oak-d", "orbbec", "turtlebot4", "spot", "stretch", "nav2"}


def test_the_presets_that_are_promised_are_there() -> None:
    assert {path.stem for path in ROBOTS} == PROMISED


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_every_section_is_valid_and_says_where_its_names_come_from(path: Path) -> None:
    sections = read(path, environment={})
    assert "ros2" in sections
    for name, model in models().items():
        section(sections, name, model)
    assert "checked neither on the robot nor with the vendor" in path.read_text(encoding="utf-8")


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_a_robot_with_these_topics_lacks_nothing(path: Path) -> None:
    config = section(read(path, environment={}), "ros2", Ros2Config)
    here = [endpoint(need.topic, need.types[0], need.kind) for need in needs(config)]
    assert missing(here, config) == {}
    topics = [need.topic for need in needs(config)]
    assert len(set(topics)) == len(topics)


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_robots_that_nav2_drives_have_time_for_its_recoveries(path: Path) -> None:
    sections = read(path, environment={})
    if sections["ros2"].get("drive") == "nav2":
        assert sections["planner"]["recovery"]["stuck_s"] >= 20
