"""``onemap bench habitat`` at the command line."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from onemap_tools.bench.habitat import benchmark
from onemap_tools.bench.habitat.benchmark import HabitatOptions
from onemap_tools.bench.habitat.choices import SuccessRule
from onemap_tools.bench.navigation.choices import Method
from onemap_tools.bench.navigation.metrics import summary
from onemap_tools.cli.app import app
from tests.tools.bench.habitat.files import SCENE_V1, objectnav, write
from tests.tools.bench.navigation.records import episode, found

RECORD = episode(0, found("bed", 1.0, 2.0))


def test_it_runs_what_is_asked_for(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked: list[Any] = []

    def run(options: HabitatOptions, **how: Any) -> dict[str, Any]:
        asked.append((options, how["out"]))
        how["report"](RECORD)
        how_run = {"about": "One.", "objects_per_episode": 1, "features": "mini"}
        return {"method": options.method.value, **how_run, **summary([RECORD], 0)}

    monkeypatch.setattr(benchmark, "run_habitat", run)
    folders = ("--episodes", "val", "--scenes", "s", "--out", str(tmp_path), "--goals", "g")
    more = ("--count", "3", "--method", "vlfm", "--success", "habitat", "--limit", "60", "--json")
    told = CliRunner().invoke(app, ["bench", "habitat", *folders, *more])
    assert told.exit_code == 0, told.output
    assert json.loads(told.stdout.splitlines()[-1])["metrics"]["spl"]["value"] == 0.5
    expected = HabitatOptions(
        Path("val"), Path("s"), Path("g"), 3, Method.VLFM, SuccessRule.HABITAT, 60.0
    )
    assert asked == [(expected, tmp_path)]
    table = CliRunner().invoke(app, ["bench", "habitat", *folders]).stdout
    assert "| **onemap, mini** | 100.0" in table


def test_without_habitat_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    imported = importlib.import_module

    def missing(name: str, package: str | None = None) -> Any:
        if name == "habitat_sim":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return imported(name, package)

    monkeypatch.setattr(importlib, "import_module", missing)
    file = write(tmp_path / "a.json.gz", objectnav(SCENE_V1, "bed"))
    folders = ("--episodes", str(file), "--scenes", "s", "--out", str(tmp_path / "out"))
    told = CliRunner().invoke(app, ["bench", "habitat", *folders, "--json"])
    assert told.exit_code == 2
    assert "build it (MIT licence) for this Python" in json.loads(told.stdout)["error"]
