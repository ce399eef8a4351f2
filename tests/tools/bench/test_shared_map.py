"""What a second robot gains: how rows are summed, and on which map it searches."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from onemap_mapper.belief.map import BeliefMap
from onemap_planner.search.events import EventStamp
from onemap_planner.search.phases import Search
from onemap_planner.search.state_machine import new_search
from onemap_tools.bench import shared_map
from onemap_tools.bench.claims import read_sections
from onemap_tools.bench.lockstep import LockstepSimulation
from onemap_tools.bench.navigation.choices import Features, Method
from onemap_tools.bench.navigation.episode_run import EpisodeSetup
from onemap_tools.bench.shared_map import SecondSearch, SharedMapRow, row_line, row_of, summarise
from onemap_tools.cli.app import app


def row(seed: int, alone: SecondSearch, shared: SecondSearch) -> SharedMapRow:
    return SharedMapRow(seed, ("sofa", "bed"), "sink", 4.0, alone, shared)


ROWS = [
    row(2, SecondSearch(True, 10.0, 40.0), SecondSearch(True, 5.0, 15.0)),
    row(4, SecondSearch(True, 20.0, 60.0), SecondSearch(True, 20.0, 50.0)),
    row(6, SecondSearch(False, 90.0, 300.0), SecondSearch(True, 6.0, 20.0)),
]


def test_ways_and_times_are_those_of_apartments_where_both_were_found() -> None:
    assert summarise(ROWS) == {
        "apartments": 3,
        "found_alone": 2,
        "found_shared": 3,
        "found_both": 2,
        "shortest_m": 8.0,
        "path_alone_m": 30.0,
        "path_shared_m": 25.0,
        "time_alone_s": 100.0,
        "time_shared_s": 65.0,
        "median_path_ratio": 0.75,
    }
    assert "path_alone_m" not in summarise(ROWS[2:])


def test_a_row_says_what_was_found() -> None:
    assert row_line(ROWS[2]) == (
        "seed 6: sink (4.0 m away)  alone not found 90.0 m 300 s  shared found 6.0 m 20 s"
    )


def test_the_command_prints_a_line_for_each_apartment(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []

    def rows(setup: EpisodeSetup) -> SharedMapRow:
        seen.append(setup.config.simulator.seed)
        return ROWS[setup.index]

    monkeypatch.setattr(shared_map, "row_of", rows)
    result = CliRunner().invoke(app, ["bench", "shared-map", "--seeds", "2,4,6", "--json"])
    assert result.exit_code == 0, result.output
    assert seen == [2, 4, 6]
    assert "seed 4: sink" in result.stderr
    document = json.loads(result.stdout.splitlines()[-1])
    assert (document["found_shared"], len(document["rows"])) == (3, 3)


def test_seeds_that_are_none_are_refused() -> None:
    result = CliRunner().invoke(app, ["bench", "shared-map", "--seeds", "odd"])
    assert result.exit_code != 0
    assert "write 1-10 or 3,5,8" in result.output


def test_the_second_search_is_on_the_map_of_the_first_robot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    setup = EpisodeSetup(
        index=0,
        config=read_sections(None, 2, "training"),
        method=Method.ONEMAP,
        features=Features.SIMULATED,
        objects=1,
        limit_s=120.0,
    )
    searches: list[tuple[tuple[str, ...], BeliefMap, int]] = []

    def search(simulation: LockstepSimulation, objects: tuple[str, ...], _limit_s: float) -> Search:
        searches.append((objects, simulation.belief, simulation._number))
        return new_search("s", objects, EventStamp(0.0, 0.0, (0.0, 0.0), 0.0), 0)

    monkeypatch.setattr(LockstepSimulation, "search", search)
    found = row_of(setup)
    (first, map_of_first, _), (name, map_of_its_own, _), (again, shared, number) = searches
    assert (first, name, again) == (found.first, (found.name,), (found.name,))
    assert shared is map_of_first
    assert map_of_its_own is not map_of_first
    assert number == 1
    assert (found.alone.success, found.shared.success) == (False, False)
    assert found.shortest_m >= 1.0
