"""The benchmark of views: a small map, and what it prints."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from onemap_shared.messages import Layer, Occupancy
from onemap_tools.bench import map_views
from onemap_tools.bench.map_views import ViewBenchOptions, run, seen_floor
from onemap_tools.bench.view_command import table_lines
from onemap_tools.cli.app import app


@pytest.fixture(scope="module")
def result() -> dict[str, Any]:
    return run(ViewBenchOptions(sizes_m=(10, 20), frames=2))


def test_what_changed_does_not_grow_with_the_map(result: dict[str, Any]) -> None:
    small, large = result["results"]
    assert (small["cells"], large["cells"]) == (100**2, 200**2)
    assert large["whole"]["bytes_p50"] > 2 * small["whole"]["bytes_p50"]
    assert large["first"]["bytes_p50"] > 3 * small["first"]["bytes_p50"]
    changes = [row["changes"]["bytes_p50"] for row in (small, large)]
    assert abs(changes[0] - changes[1]) < 100 < result["frame_cells"]
    assert changes[0] < small["whole"]["bytes_p50"] / 4


def test_the_table_has_a_line_for_each_kind_of_view(result: dict[str, Any]) -> None:
    lines = [line.split() for line in table_lines(result)]
    assert lines[0][:3] == ["size_m", "fuse_ms", "view"]
    assert [line[2] for line in lines[1:]] == ["changes", "first", "whole"] * 2


def test_the_floor_of_the_benchmark_is_seen_everywhere() -> None:
    belief = seen_floor(10, np.random.default_rng(0))
    assert np.count_nonzero(belief.occupancy_grid() == Occupancy.FREE) == 100**2
    everything = Layer.OBSERVED | Layer.EXPLORED | Layer.SEARCHED | Layer.FLOOR_SEEN
    assert np.count_nonzero(belief.layers() == everything) == 100**2


def test_the_command_prints_one_object(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[ViewBenchOptions] = []

    def noted(options: ViewBenchOptions) -> dict[str, Any]:
        asked.append(options)
        return {"ran": True}

    monkeypatch.setattr(map_views, "run", noted)
    arguments = ["bench", "view", "--size", "20", "--frames", "3", "--seed", "4", "--json"]
    printed = CliRunner().invoke(app, arguments)
    assert printed.exit_code == 0
    assert json.loads(printed.stdout.splitlines()[-1]) == {"ran": True}
    assert asked == [ViewBenchOptions((20,), 3, 4)]
