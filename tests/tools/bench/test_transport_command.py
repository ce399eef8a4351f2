"""``onemap bench transport`` at the command line."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from typer.testing import CliRunner

from onemap_tools.bench.transport import benchmark, streams
from onemap_tools.bench.transport.link_shape import LinkShape
from onemap_tools.cli.app import app

Asked = list[tuple[Any, Any, Any]]


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Asked:
    """What the benchmark is asked for, instead of running it."""
    calls: Asked = []

    def run(made: Any, settings: Any, params: Any) -> Iterator[dict[str, Any]]:
        calls.append((made, settings, params))
        yield {"setting": "thin", "rate_hz": 8.0}

    monkeypatch.setattr(benchmark, "run", run)
    monkeypatch.setattr(benchmark, "emulation_problem", lambda: "")
    monkeypatch.setattr(streams, "make_stream", lambda encoder, size: (encoder.channels, size))
    return calls


def bench(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["bench", *arguments])
    return result.exit_code, result.stdout if result.exit_code == 0 else result.output


def test_link_settings_and_streams_are_passed_on(asked: Asked) -> None:
    link = ("--link", "30", "--delay", "20", "--loss", "1", "--congestion-control", "reno")
    what = ("--setting", "thin", "--setting", "narrow", "--streams", "1", "--streams", "4")
    code, text = bench("transport", *link, *what, "--rate", "8", "--size", "160x120", "--json")
    assert code == 0, text
    assert json.loads(text.splitlines()[-1])["results"][0] == {"setting": "thin", "rate_hz": 8.0}
    assert [params.streams for _, _, params in asked] == [1, 4]
    made, settings, params = asked[0]
    assert made == {0: (0, (160, 120)), 128: (128, (160, 120))}
    assert list(settings) == ["thin", "narrow"]
    assert params.shape == LinkShape(30e6, 0.02, 0.01)
    assert (params.congestion_control, params.rate_hz) == ("reno", 8.0)


def test_without_a_link_all_is_on_loopback(asked: Asked) -> None:
    code, text = bench("transport")
    assert code == 0
    assert "setting thin  rate_hz 8.0" in text
    _, settings, params = asked[0]
    assert params.shape is None
    assert list(settings) == list(benchmark.SETTINGS)


def test_a_link_that_cannot_be_emulated_ends_with_a_sentence(
    asked: Asked, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(benchmark, "emulation_problem", lambda: "emulated links need root")
    code, text = bench("transport", "--link", "30")
    assert code == 2
    assert "emulated links need root" in text
    assert asked == []


@pytest.mark.parametrize(
    "wrong", [("--setting", "fast"), ("--loss", "70"), ("--streams", "0"), ("--size", "big")]
)
def test_wrong_options_are_refused(asked: Asked, wrong: tuple[str, str]) -> None:
    code, _ = bench("transport", *wrong)
    assert code == 2
