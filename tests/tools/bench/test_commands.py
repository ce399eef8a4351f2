"""``onemap bench`` at the command line: options, the last line, exit codes."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import asdict, fields
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from onemap_tools.bench import fusion, system
from onemap_tools.bench.options import BENCHMARKS, Options, SystemBench
from onemap_tools.cli.app import app


def bench(*arguments: object) -> tuple[int, str]:
    """Exit code and output; of a success, what a program reads."""
    result = CliRunner().invoke(app, ["bench", *map(str, arguments)])
    return result.exit_code, result.stdout if result.exit_code == 0 else result.output


def plain(options: Options, tell: Callable[[str], None]) -> dict[str, Any]:
    """In place of a benchmark: its options."""
    tell("going on")
    return {name: str(value) for name, value in asdict(options).items()}


@pytest.mark.parametrize("options", BENCHMARKS, ids=lambda each: each.__name__)
def test_every_benchmark_runs_with_its_defaults_and_prints_one_object_last(
    options: type[Options], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    module = import_module(f"onemap_tools.bench.{options.module}")
    monkeypatch.setattr(module, "run", plain)
    monkeypatch.delattr(module, "lines", raising=False)
    required: dict[str, list[object]] = {
        "habitat": ["--episodes", "a", "--scenes", "b", "--out", tmp_path / "c"],
    }
    name = options.__name__.removesuffix("Bench").lower()
    names = {field.name for field in fields(options)}
    code, text = bench(name, *required.get(name, []), "--json")
    assert code == 0, text
    assert set(json.loads(text.splitlines()[-1])) == names
    assert "going on" not in text  # progress goes to stderr
    _, table = bench(name, *required.get(name, []))
    assert all(f"\n{field} " in f"\n{table}" for field in names)


def test_options_arrive_as_they_were_given(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Options] = []

    def run(options: Options, _tell: object) -> dict[str, Any]:
        asked.append(options)
        return {"sent_hz": 8.0}

    monkeypatch.setattr(system, "run", run)
    monkeypatch.delattr(system, "lines")
    code, text = bench("system", "--robots", "4", "--rate", "5")
    assert (code, text.split()) == (0, ["sent_hz", "8.0"])
    assert asked == [SystemBench(robots=4, rate=5.0)]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("fusion", "--frames", "0"), "--frames"),
        (("system", "--size", "640"), "size is '640'; write it like 640x480"),
        (("navigation", "--method", "luck"), "'luck' is not one of"),
        (("habitat", "--episodes", "none"), "--scenes"),
    ],
)
def test_wrong_options_end_with_2_and_a_sentence(arguments: tuple[str, ...], sentence: str) -> None:
    code, text = bench(*arguments)
    assert code == 2
    assert sentence in " ".join(re.sub(r"[│\x1b]", " ", text).split())


def test_a_missing_package_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(*_: object) -> None:
        raise ModuleNotFoundError("No module named 'torch'", name="torch")

    monkeypatch.setattr(fusion, "run", run)
    code, text = bench("fusion")
    assert code == 2
    assert "needs the package 'torch': pip install -e '.[mapper]'" in text
