from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from onemap_perception.encoders.mini import MiniParams
from onemap_shared.config import LinkParams
from onemap_tools.bench.transport import benchmark as bench
from onemap_tools.bench.transport.benchmark import (
    COMPRESSED,
    Setting,
    TransportBenchParams,
    measure,
    run,
    summary,
)
from onemap_tools.bench.transport.link_shape import LinkShape
from onemap_tools.bench.transport.network import emulation_problem
from onemap_tools.bench.transport.streams import make_stream

THIN = COMPRESSED.model_copy(update={"window": 2})


def counted(ages: list[list[tuple[float, float]]], **metrics: float) -> dict[str, Any]:
    return {
        "mapper": {"streams": [{"ages": each, "metrics": {}} for each in ages]},
        "perception": {"streams": [{"ages": [], "metrics": metrics}]},
        "robot": {"streams": [{"ages": [], "metrics": metrics}]},
    }


def test_rates_and_ages_are_those_of_the_measured_time() -> None:
    first = [(9.0, 5.0), *[(10.0 + 0.1 * i, 0.2) for i in range(20)], (12.5, 5.0)]
    second = [(10.0 + 0.5 * i, 0.4) for i in range(4)]
    row = summary(counted([first, second], link_field_replaced=2.0), 10.0, 12.0)
    assert (row["rate_hz"], row["slowest_hz"]) == (6.0, 2.0)
    assert (row["age_p50_ms"], row["age_p95_ms"]) == (200, 400)
    assert (row["replaced"], row["overdue"]) == (4, 0)


def test_a_stream_that_never_arrives_is_a_rate_of_zero() -> None:
    row = summary(counted([[]]), 0.0, 1.0)
    assert row["rate_hz"] == row["slowest_hz"] == 0
    assert row["age_p50_ms"] is row["age_p95_ms"] is None


def test_no_link_is_emulated_where_it_cannot_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "emulation_problem", lambda: "needs root")
    with pytest.raises(ValueError, match="needs root"):
        bench.check(LinkShape(1e6))
    bench.check(None)


@pytest.fixture(scope="module")
def stream_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("stream") / "s.npz"
    make_stream(MiniParams(), (160, 120), 4).save(path)
    return path


@pytest.mark.slow
@pytest.mark.parametrize("link", [LinkParams(), THIN], ids=["raw", "thin"])
def test_two_streams_reach_the_map_over_loopback(stream_file: Path, link: LinkParams) -> None:
    row = measure(stream_file, link, TransportBenchParams(streams=2, rate_hz=5.0, seconds=3.0))
    assert row["slowest_hz"] > 0
    assert row["age_p50_ms"] > 0


@pytest.mark.slow
@pytest.mark.timeout(240)
def test_a_window_bounds_the_age_on_a_thin_link(stream_file: Path) -> None:
    """At a fraction of what the camera sends: without a window the queues fill first."""
    if problem := emulation_problem():
        pytest.skip(problem)
    link = LinkShape(4e6, 0.02, 0.01)
    params = TransportBenchParams(shape=link, rate_hz=15.0, seconds=8.0)
    rows = {
        name: measure(stream_file, setting, params)
        for name, setting in (("queued", COMPRESSED), ("window", THIN))
    }
    assert rows["window"]["rate_hz"] > 0
    assert rows["window"]["replaced"] > rows["queued"]["replaced"]  # a busy machine may drop some
    assert rows["window"]["age_p95_ms"] < rows["queued"]["age_p95_ms"]
    for row in rows.values():
        assert row["down_mbit_s"] < 4.5  # the link was the link


@pytest.mark.slow
def test_every_setting_has_a_row() -> None:
    stream = make_stream(MiniParams(), (160, 120), 2)
    settings = {"raw": Setting(LinkParams()), "thin": Setting(THIN)}
    rows = list(run({0: stream}, settings, TransportBenchParams(rate_hz=5.0, seconds=1.0)))
    assert [row["setting"] for row in rows] == ["raw", "thin"]
    assert rows[1]["field_kb"] < rows[0]["field_kb"] / 2
