"""An episode over the real processes is the demo in the episode's apartment, judged alike."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from onemap_tools.bench.claims import read_sections
from onemap_tools.bench.navigation import process_run
from onemap_tools.bench.navigation.benchmark import NavigationOptions
from onemap_tools.bench.navigation.choices import Features, Method
from onemap_tools.bench.navigation.episode_run import EpisodeSetup
from onemap_tools.bench.navigation.episodes import NavigationEpisode
from onemap_tools.bench.navigation.process_run import (
    demo_options,
    process_record,
    run_in_processes,
)
from onemap_tools.bench.navigation.records import Failure
from onemap_tools.demo.setup import DemoOptions, demo_sections
from onemap_tools.errors import CliError

EPISODE = NavigationEpisode(2, ("bed", "sofa", "toilet"), (1.5, 2.5, 0.5))
FOUND = {
    "name": "bed",
    "outcome": "found",
    "reason": "confirmed",
    "position_m": [1.0, 2.0, 0.4],
    "time_s": 20.0,
    "path_length_m": 5.0,
    "shortest_path_m": 4.0,
    "true_distance_m": 0.8,
    "goal_distance_m": 0.0,
    "nearest": "bed",
    "judged": True,
}
LOST = {
    **FOUND,
    "name": "sofa",
    "outcome": "not_found",
    "shortest_path_m": None,
    "goal_distance_m": None,
    "position_m": [],
}


def setup_of(seed: int) -> EpisodeSetup:
    config = read_sections(None, seed, "training")
    return EpisodeSetup(3, config, Method.ONEMAP_PROCESSES, Features.MINI, 3, 60.0)


def document(*objects: dict[str, Any]) -> dict[str, Any]:
    return {"objects": list(objects), "contacts": 2, "search_s": 44.5}


def test_the_record_is_judged_as_in_simulated_time() -> None:
    record = process_record(3, EPISODE, document(FOUND, LOST))
    assert [item.name for item in record.objects] == ["bed", "sofa", "toilet"]
    assert [item.success for item in record.objects] == [True, False, False]
    assert record.objects[0].spl == pytest.approx(0.8)
    assert [item.failure for item in record.objects[1:]] == [Failure.NOT_FOUND] * 2
    assert record.objects[1].shortest_path_m is None
    assert (record.contacts, record.simulated_s, record.start) == (2, 44.5, EPISODE.start)


def test_a_robot_that_does_not_count_contacts_has_none() -> None:
    assert process_record(0, EPISODE, {**document(), "contacts": None}).contacts == 0


def test_the_processes_get_the_settings_start_and_limit_of_the_episode(tmp_path: Path) -> None:
    options = demo_options(setup_of(2), EPISODE, tmp_path)
    sections = demo_sections({}, options, "tcp/127.0.0.1:7447")
    assert sections["simulator"]["start"] == [1.5, 2.5, 0.5]
    assert sections["simulator"]["seed"] == 2
    assert sections["planner"]["explore"]["object_limit_s"] == 60.0
    assert options.objects == EPISODE.objects
    assert options.time_limit_s > 3 * 60.0


def test_an_episode_is_drawn_run_and_named_when_it_fails(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[DemoOptions] = []

    def demo(options: DemoOptions, console: Console) -> dict[str, Any]:
        assert not console.is_terminal
        asked.append(options)
        if len(asked) > 1:
            raise CliError("mapper ended")
        return document()

    monkeypatch.setattr(process_run, "run", demo)
    record = run_in_processes(setup_of(2))
    assert tuple(item.name for item in record.objects) == asked[0].objects
    assert not any(item.success for item in record.objects)
    with pytest.raises(ValueError, match="seed 2 ended: mapper ended"):
        run_in_processes(setup_of(2))


def test_simulated_features_are_refused() -> None:
    options = NavigationOptions(Method.ONEMAP_PROCESSES, Features.SIMULATED, 1, 1)
    with pytest.raises(ValueError, match="give --features mini"):
        options.setups()
