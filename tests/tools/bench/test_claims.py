"""The study of claims: what is counted, and a search in simulated time that repeats itself."""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf
from pathlib import Path

import pytest

from onemap_shared.config import ConfigError
from onemap_tools.bench.claims import (
    EpisodeParams,
    EpisodeResult,
    episode_line,
    parse_seeds,
    read_sections,
    run,
    summarise,
)
from onemap_tools.demo.summary import ObjectSummary

BED = ObjectSummary(
    name="bed",
    outcome="found",
    reason="",
    position_m=(1.0, 2.0, 0.4),
    time_s=10.0,
    path_length_m=8.0,
    shortest_path_m=4.0,
    true_distance_m=1.0,
    goal_distance_m=0.0,
    nearest="bed",
)
SOFA = replace(BED, name="sofa", goal_distance_m=0.5, nearest="armchair")
DESK = replace(BED, name="desk", outcome="not_found", goal_distance_m=inf, shortest_path_m=inf)
EPISODE = EpisodeResult(7, (BED, SOFA, DESK), (True, True, False), simulated_s=50.0, wall_s=40.0)


@pytest.mark.parametrize(
    ("text", "seeds"), [("1-3", [1, 2, 3]), ("5", [5]), ("2,4-5,9", [2, 4, 5, 9])]
)
def test_seeds_are_read_as_ranges_and_lists(text: str, seeds: list[int]) -> None:
    assert parse_seeds(text) == seeds


@pytest.mark.parametrize("text", ["", "three", "5-1"])
def test_seeds_that_name_none_are_refused_in_a_sentence(text: str) -> None:
    with pytest.raises(ValueError, match="--seeds is"):
        parse_seeds(text)


def test_the_summary_counts_claims_and_names_what_stands_there() -> None:
    summary = summarise([EPISODE], ("bed", "sofa", "desk"))
    assert (summary["sought"], summary["there"], summary["found"]) == (3, 2, 1)
    assert (summary["claimed_wrongly"], summary["absent_and_not_claimed"]) == (1, 1)
    assert summary["spl"] == pytest.approx(0.25)  # half of the way was needed, for one of two
    assert summary["wrong"] == [
        {"seed": 7, "claimed": "sofa", "stands_there": "armchair", "stopped_off_m": 0.5}
    ]
    json.dumps(summary, allow_nan=False)
    line = episode_line(EPISODE)
    assert "sofa: WRONG, armchair there, 0.5 m short" in line
    assert "desk: not found (absent)" in line


def test_the_settings_are_the_file_s_in_the_apartment_asked_for(tmp_path: Path) -> None:
    file = tmp_path / "noisy.yaml"
    file.write_text("simulator: {seed: 3, camera: {depth_noise_m: 0.01}}\n")
    config = read_sections(file, 9, "held out")
    assert (config.simulator.seed, config.simulator.style) == (9, "held out")
    assert config.simulator.camera.depth_noise_m == 0.01
    file.write_text("planner: {plan_hz: -1}\n")
    with pytest.raises(ConfigError, match=r"planner\.plan_hz"):
        read_sections(file, 1, "training")


@pytest.mark.slow
def test_what_the_time_did_not_suffice_for_was_not_found() -> None:
    (couch, bed) = run(
        EpisodeParams(read_sections(None, 2, "training"), ("couch", "bed"), 0.5)
    ).objects
    assert (couch.outcome, bed.outcome) == ("not_found", "not_found")
    assert (couch.judged, bed.judged) == (False, False)


@pytest.mark.slow
def test_a_search_in_simulated_time_finds() -> None:
    task = EpisodeParams(read_sections(None, 2, "training"), ("bed",), 60.0)
    (bed,) = run(task).objects
    assert bed.success, bed.reason
    assert 0.5 < bed.spl <= 1.0


@pytest.mark.slow
def test_a_search_in_simulated_time_repeats_itself() -> None:
    task = EpisodeParams(read_sections(None, 2, "training"), ("bed",), 3.0)
    first, second = run(task), run(task)
    assert replace(first, wall_s=0.0) == replace(second, wall_s=0.0)
