"""``onemap bench`` at the command line: options, the last line, and exit codes."""

from __future__ import annotations

import json
import re
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from onemap_tools.bench import fusion, perception, queries
from onemap_tools.bench.navigation import benchmark
from onemap_tools.bench.navigation.benchmark import NavigationOptions
from onemap_tools.bench.navigation.choices import Apartments, Features, Method
from onemap_tools.bench.navigation.metrics import summary
from onemap_tools.bench.query_report import QueryBenchParams
from onemap_tools.cli.app import app
from tests.tools.bench.navigation.records import episode, found


def bench(*arguments: str) -> tuple[int, str]:
    """Exit code and output; of a success, what a program reads."""
    result = CliRunner().invoke(app, ["bench", *arguments])
    return result.exit_code, result.stdout if result.exit_code == 0 else result.output


def test_fusion_prints_a_table_or_one_object(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fusion, "run", asdict)
    code, text = bench("fusion", "--frames", "7", "--threads", "2", "--json")
    assert code == 0
    document = json.loads(text.splitlines()[-1])
    assert (document["frames"], document["device"], document["threads"]) == (7, "cpu", 2)
    _, table = bench("fusion")
    assert table.splitlines()[0].split() == ["frames", "50"]


def test_perception_measures_what_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def run(backends: tuple[str, ...], params: object) -> dict[str, Any]:
        asked.append((backends, params))
        return {"results": [{"backend": "mini", "problem": "no such file"}]}

    monkeypatch.setattr(perception, "run", run)
    options = ("--random-weights", "--backend", "mini", "--backend", "tipsv2", "--device", "cpu")
    code, text = bench("perception", *options, "--size", "320x240", "--frames", "3")
    assert code == 1  # one could not be measured
    assert "problem no such file" in text
    ((backends, params),) = asked
    assert backends == ("mini", "tipsv2")
    assert params == perception.PerceptionBenchParams(
        frames=3,
        size_px=(320, 240),
        architecture="convnext_large_d_320",
        devices=("cpu",),
    )


def test_queries_maps_as_many_apartments_as_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def run(config: object, params: object, report: object) -> dict[str, Any]:
        asked.append(params)
        return {"benchmark": "queries"}

    monkeypatch.setattr(queries, "run_configured", run)
    options = ("--apartments", "4", "--pictures", "9", "--style", "held-out")
    code, text = bench("queries", *options, "--json")
    assert (code, json.loads(text.splitlines()[-1])) == (0, {"benchmark": "queries"})
    styles = queries.STYLES["held-out"]
    assert asked == [QueryBenchParams(seeds=(800, 801, 802, 803), styles=styles, images=9)]


def test_navigation_runs_what_is_asked_for(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked: list[Any] = []

    def run(options: NavigationOptions, **how: Any) -> dict[str, Any]:
        asked.append((options, how["workers"], how["out"], how["beside"]))
        how["report"](episode(1, found("bed", 1.0, 2.0)))
        return {
            **options.document(),
            **summary([episode(1, found("bed", 1.0, 2.0))], 1),
            "compared_with": {},
        }

    monkeypatch.setattr(benchmark, "run_benchmark", run)
    options = ("--method", "nearest_frontier", "--features", "mini", "--episodes", "2")
    more = (
        "--apartments",
        "odd",
        "--seed",
        "4",
        "--workers",
        "2",
        "--out",
        str(tmp_path),
        "--beside",
        "a",
    )
    code, text = bench("navigation", *options, *more, "--json")
    assert code == 0, text
    assert json.loads(text.splitlines()[-1])["metrics"]["spl"]["value"] == 0.5
    expected = NavigationOptions(
        Method.NEAREST_FRONTIER, Features.MINI, 2, 4, apartments=Apartments.ODD
    )
    assert asked == [(expected, 2, tmp_path, [Path("a")])]
    _, table = bench("navigation")
    assert "SPL per object                         0.500" in table


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("fusion", "--frames", "0"), "--frames"),
        (("perception", "--size", "640"), "size is '640'; write it like 640x480"),
        (("perception", "--frames", "0"), "--frames"),
        (("navigation", "--style", "baroque"), "'baroque' is not one of"),
        (("queries", "--apartments", "1"), "--apartments"),
        (("navigation", "--method", "luck"), "'luck' is not one of"),
    ],
)
def test_wrong_options_end_with_2_and_a_sentence(arguments: tuple[str, ...], sentence: str) -> None:
    code, text = bench(*arguments)
    assert code == 2
    assert sentence in " ".join(re.sub(r"[│\x1b]", " ", text).split())


def test_a_missing_package_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(frames: int, **_: object) -> None:
        raise ModuleNotFoundError("No module named 'torch'", name="torch")

    monkeypatch.setattr(fusion, "run", run)
    code, text = bench("fusion")
    assert code == 2
    assert "needs the package 'torch': pip install 'onemap[mapper]'" in text
