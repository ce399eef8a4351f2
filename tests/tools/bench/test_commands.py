"""``onemap bench`` at the command line: options, the last line, exit codes."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from onemap_tools.bench import fusion, perception
from onemap_tools.bench.options import BENCHMARKS, Options, TransportBench
from onemap_tools.bench.transport import benchmark as transport
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
    (tmp_path / "room.glb").touch()
    required: dict[str, list[object]] = {
        "scene": [tmp_path / "room.glb"],
        "habitat": ["--episodes", "a", "--scenes", "b", "--out", tmp_path / "c"],
    }
    name = options.__name__.removesuffix("Bench").lower()
    code, text = bench(name, *required.get(name, []), "--json")
    assert code == 0, text
    assert set(json.loads(text.splitlines()[-1])) == set(asdict(_defaults(options)))
    assert "going on" not in text  # progress goes to stderr
    _, table = bench(name, *required.get(name, []))
    assert all(f"\n{field} " in f"\n{table}" for field in asdict(_defaults(options)))


def _defaults(options: type[Options]) -> Options:
    given = {"path", "episodes", "scenes", "out"} & set(options.__dataclass_fields__)
    return options(**dict.fromkeys(given))


def test_options_arrive_as_they_were_given(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Options] = []

    def run(options: Options, _tell: object) -> dict[str, Any]:
        asked.append(options)
        return {"results": [{"setting": "thin", "rate_hz": 8.0}]}

    monkeypatch.setattr(transport, "run", run)
    what = ("--setting", "thin", "--setting", "narrow", "--streams", "1", "--streams", "4")
    code, text = bench("transport", "--congestion-control", "reno", *what, "--rate", "8")
    assert (code, text) == (0, "setting thin  rate_hz 8.0\n")
    settings = ["thin", "narrow"]
    assert asked == [
        TransportBench(congestion_control="reno", setting=settings, streams=[1, 4], rate=8.0)
    ]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("fusion", "--frames", "0"), "--frames"),
        (("perception", "--size", "640"), "size is '640'; write it like 640x480"),
        (("navigation", "--method", "luck"), "'luck' is not one of"),
        (("transport", "--setting", "fast"), "--setting is 'fast'; there are raw, window,"),
        (("perception", "--random-weights", "--backend", "x"), "--backend is 'x'; there are mini"),
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


def test_what_could_not_be_measured_ends_with_1(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [{"backend": "mini", "problem": "no such file"}]
    monkeypatch.setattr(perception, "run", lambda *_: {"results": rows})
    code, text = bench("perception")
    assert code == 1
    assert "backend mini  problem no such file" in text
