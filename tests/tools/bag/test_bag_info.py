"""What is said of a bag."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from onemap_shared import keys
from onemap_shared.messages import AnsweredQuery, Verdict
from onemap_tools.bag.bag_file import BagWriter
from onemap_tools.bag.bag_info import describe, info
from tests.gateway import fakes
from tests.tools.bag.bags import RecordedRobot


@pytest.fixture
def recorded(tmp_path: Path) -> Path:
    robot = RecordedRobot(tmp_path)
    robot.begin()
    robot.see(0, 1)
    robot.update()
    robot.see(2)
    robot.bus.publish(keys.DETECTIONS).put(fakes.detections("sofa"))
    return robot.end()


def test_it_says_what_is_in_it(recorded: Path) -> None:
    document = info(recorded)
    topics = {each["topic"]: each for each in document["topics"]}
    assert topics["perception/field/v1"]["messages"] == 3
    assert topics["perception/field/v1"]["schema"] == "onemap.FeatureField/1"
    assert topics["perception/field/v1"]["rate_hz"] == 2.0
    assert (document["seconds"], document["cut_off"]) == (1.0, False)
    assert (document["encoders"], document["detectors"]) == (["encoder-a"], ["fake"])
    assert document["map"]["frames_fused"] == 3
    assert document["bytes"] == recorded.stat().st_size
    text = "\n".join(describe(document))
    assert "perception/field/v1" in text
    assert "Encoder: encoder-a\nDetector: fake" in text
    assert "Map: 3 frames at revision 3" in text
    assert "cut off" not in text


def test_it_says_what_was_asked(tmp_path: Path) -> None:
    robot = RecordedRobot(tmp_path)
    robot.begin()
    queries = robot.bus.publish(keys.MAP_QUERIES)
    sofa = AnsweredQuery("sofa", 1, 123, "encoder-a", Verdict.NOT_LOOKED_YET, 0.1)
    queries.put(sofa)
    queries.put(replace(sofa, verdict=Verdict.FOUND, best_score=0.9, centre_m=(1.0, 2.0)))
    queries.put(replace(sofa, text="bed"))
    document = info(robot.end())
    assert document["queries"] == [
        {
            "text": "sofa",
            "times": 2,
            "verdict": "found",
            "best_score": 0.9,
            "centre_m": [1.0, 2.0],
        },
        {
            "text": "bed",
            "times": 1,
            "verdict": "not_looked_yet",
            "best_score": 0.1,
            "centre_m": None,
        },
    ]
    text = "\n".join(describe(document))
    assert (
        "Asked 2 times for 'sofa', last answered found with the score 0.90 at (1.00, 2.00)" in text
    )


def test_a_bag_that_was_cut_off_says_so(recorded: Path) -> None:
    recorded.write_bytes(recorded.read_bytes()[:-30])
    document = info(recorded)
    assert document["cut_off"]
    assert "It was cut off" in describe(document)[1]


def test_an_empty_bag_has_no_rates(tmp_path: Path) -> None:
    path = tmp_path / "empty.mcap"
    BagWriter(path, {}).close({})
    document = info(path)
    assert (document["topics"], document["map"], document["seconds"]) == ([], None, 0.0)
    assert len(describe(document)) == 1
