"""Every configuration and preset that ships is one that every service accepts."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from onemap_planner.policy.params import PlannerParams
from onemap_ros2.config import Ros2Config
from onemap_ros2.topic_list import missing, needs
from onemap_shared.config import read, section
from tests.deploy.deployment import CONFIGURATIONS, DEPLOY, PRESETS, models
from tests.ros2.stock_nav2 import TOLERANCE_M
from tests.ros2.test_topic_list import endpoint


@pytest.mark.parametrize("path", [*CONFIGURATIONS, *PRESETS], ids=lambda path: path.stem)
def test_every_section_is_valid_for_its_service(path: Path) -> None:
    sections = read(path, environment={})
    for name, model in models().items():
        section(sections, name, model)


def test_state_lies_where_units_and_volumes_put_it() -> None:
    for name in ("workstation", "jetson", "shared-map"):
        document = yaml.safe_load((DEPLOY / "config" / f"{name}.yaml").read_text(encoding="utf-8"))
        for place in (document["mapper"]["map_folder"], document["planner"]["state_dir"]):
            assert Path(place).is_relative_to("/var/lib/onemap")


@pytest.mark.parametrize("path", PRESETS, ids=lambda path: path.stem)
def test_a_robot_with_the_topics_of_its_preset_lacks_nothing(path: Path) -> None:
    """And the file says where its names come from."""
    assert "checked neither on the robot nor with the vendor" in path.read_text(encoding="utf-8")
    sections = read(path, environment={})
    config = section(sections, "ros2", Ros2Config)
    here = [endpoint(need.topic, need.types[0], need.kind) for need in needs(config)]
    assert missing(here, config) == {}
    topics = [need.topic for need in needs(config)]
    assert len(set(topics)) == len(topics)
    if sections["ros2"].get("drive") == "nav2":  # which has recoveries of its own
        assert sections["planner"]["recovery"]["stuck_s"] >= 20
        farthest_m = sections["planner"]["explore"]["approach_farthest_m"]
        assert farthest_m + TOLERANCE_M <= PlannerParams().explore.approach_farthest_m
