"""The benchmark: processes, a folder that goes on, one result."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from onemap_shared.messages import SearchOrder
from onemap_tools.bench.navigation import benchmark
from onemap_tools.bench.navigation.benchmark import NavigationOptions, run_benchmark
from onemap_tools.bench.navigation.choices import Apartments, Errors, Features, Method
from onemap_tools.bench.navigation.episode_run import EpisodeSetup
from onemap_tools.bench.navigation.metrics import summary
from onemap_tools.bench.navigation.records import EpisodeRecord, Failure
from onemap_tools.bench.navigation.report import episode_line, table_lines
from tests.tools.bench.navigation.records import episode, failed

OPTIONS = NavigationOptions(Method.ORACLE, Features.SIMULATED, 3, 1, Apartments.ODD, objects=2)


def test_the_options_name_every_episode() -> None:
    setups = OPTIONS.setups()
    assert [setup.config.simulator.seed for setup in setups] == [1, 3, 5]
    assert [setup.index for setup in setups] == [0, 1, 2]
    assert OPTIONS.document()["config"]["planner"]["explore"]["patience_s"] == 30.0


def test_any_order_is_an_option_of_the_methods_that_keep_a_map_for_all_objects() -> None:
    options = replace(OPTIONS, method=Method.ONEMAP, order=SearchOrder.ANY)
    assert [setup.order for setup in options.setups()] == [SearchOrder.ANY] * 3
    assert options.document()["order"] == "any"
    with pytest.raises(ValueError, match="--order any is for onemap and onemap_no_consensus"):
        replace(OPTIONS, method=Method.VLFM, order=SearchOrder.ANY)


def test_errors_are_simulated_in_every_episode_and_told_with_the_result() -> None:
    options = replace(OPTIONS, errors=Errors.PEOPLE)
    assert [setup.config.simulator.people.count for setup in options.setups()] == [2, 2, 2]
    document = options.document()
    assert document["errors"] == "people"
    assert document["config"]["simulator"]["people"]["count"] == 2
    touched = replace(episode(0, failed("bed", 1.0, Failure.STUCK)), people_touched=2)
    result = {**document, **summary([touched], 1), "compared_with": {}}
    lines = table_lines(result)
    assert lines[0].startswith("oracle, simulated features, errors: people: 1 episodes")
    assert "contacts with people, all episodes     2" in lines
    assert not any("loop closures" in line for line in lines)


def test_stairwells_are_an_option_of_simulated_time_and_told_with_the_result() -> None:
    options = replace(OPTIONS, method=Method.ONEMAP, stairwells=2)
    assert [setup.stairwells for setup in options.setups()] == [2, 2, 2]
    crossed = replace(
        episode(0, failed("bed", 1.0, Failure.STUCK)),
        stairwells=((1.0, 2.0, 1.5, 3.0),),
        edges_crossed=2,
    )
    result = {**options.document(), **summary([crossed], 1), "compared_with": {}}
    lines = table_lines(result)
    assert lines[0].startswith("onemap, simulated features, 2 stairwells: 1 episodes")
    assert "stairwells, all episodes               1" in lines
    assert "wheels over an edge, all episodes      2" in lines
    whole = table_lines({**result, "edges_crossed": 0})
    assert "wheels over an edge, all episodes      0" in whole
    assert "stairwells_per_episode" not in OPTIONS.document()


@pytest.mark.slow
def test_a_run_goes_on_where_it_was_killed(tmp_path: Path) -> None:
    ran: list[EpisodeRecord] = []
    options = replace(OPTIONS, episodes=2, objects=1)
    first = run_benchmark(options, workers=2, out=tmp_path, report=ran.append)
    assert [len(ran), first["episodes"], first["metrics"]["spl"]["value"]] == [2, 2, 1.0]
    file = tmp_path / "episodes.jsonl"
    file.write_text(file.read_text()[:-40])
    ran.clear()
    second = run_benchmark(options, workers=1, out=tmp_path, report=ran.append)
    assert len(ran) == 1  # the other was finished
    for result in (first, second):
        del result["wall_s"]
        for each in result["results"]:
            del each["wall_s"]
    assert first == second
    assert json.loads((tmp_path / "results.json").read_text())["episodes"] == 2
    with pytest.raises(ValueError, match="episodes 2 instead of 4"):
        run_benchmark(replace(options, episodes=4), workers=1, out=tmp_path, report=ran.append)
    assert "found, SPL 1.00" in episode_line(ran[0])
    same = run_benchmark(options, workers=1, out=tmp_path, report=ran.append, beside=(tmp_path,))
    assert same["compared_with"]["oracle"]["compared"]["spl"] == {
        "value": 1.0,
        "low": 1.0,
        "high": 1.0,
    }


@pytest.mark.slow
def test_the_table_has_a_line_for_every_metric_and_the_folder_a_picture(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def run_all(setups: list[EpisodeSetup], workers: int, out: Path) -> list[EpisodeRecord]:
        assert workers == 2
        return [benchmark.timed_episode(setup, out) for setup in setups]

    monkeypatch.setattr(benchmark, "run_all", run_all)
    options = replace(OPTIONS, episodes=1)
    result = run_benchmark(options, workers=2, out=tmp_path, report=lambda _: None)
    assert (tmp_path / "episode_0000.png").read_bytes().startswith(b"\x89PNG")
    lines = table_lines(result)
    assert lines[0] == "oracle, simulated features: 1 episodes, 2 objects, 95 % intervals"
    assert any(line.startswith("SPL of object 2") for line in lines)
    assert any(line.startswith("failed: never in view") for line in lines)


def test_a_failure_is_named_in_the_episode_s_line() -> None:
    late = replace(failed("fan", 2.0, Failure.NEVER_IN_VIEW), timed_out=True)
    line = episode_line(episode(6, failed("bed", 1.0, Failure.STUCK), late))
    assert line == "apartment 7, 60 s: bed: the search failed; fan: never in view (time)"
