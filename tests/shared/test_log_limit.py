"""What a process logs is bounded, whatever arrives."""

from __future__ import annotations

import io
import logging
from collections.abc import Callable, Iterator

import pytest

from onemap_shared.runner import MAX_CHARS, PERIOD_S, LogLimit

LOG = logging.Logger("onemap.test_log_limit", logging.INFO)  # of this module alone


@pytest.fixture
def now_s() -> list[float]:
    return [100.0]


@pytest.fixture
def lines(now_s: list[float]) -> Iterator[Callable[[], list[str]]]:
    stream = io.StringIO()
    handler = logging.StreamHandler(stream)
    handler.addFilter(LogLimit(lambda: now_s[0]))
    LOG.addHandler(handler)
    yield lambda: stream.getvalue().splitlines()
    LOG.removeHandler(handler)


def test_ten_minutes_of_bad_messages_is_one_line_in_ten_seconds(
    lines: Callable[[], list[str]], now_s: list[float]
) -> None:
    for index in range(47 * 600):
        now_s[0] = 100 + index / 47
        LOG.warning("message refused: %s", f"{index} " + "x" * 5000)
    logged = lines()
    assert len(logged) == pytest.approx(600 / PERIOD_S, abs=1)
    assert logged[0].startswith("message refused: 0 x")
    assert logged[1].endswith("(and 469 more before)")
    assert sum(map(len, logged)) < 1.1 * MAX_CHARS * len(logged)


def test_kinds_do_not_silence_each_other(lines: Callable[[], list[str]]) -> None:
    for stream in ("odometry", "rgbd"):
        LOG.warning(f"{stream}: refused %s", "a")
        LOG.warning(f"{stream}: refused %s", "b")
    assert lines() == ["odometry: refused a", "rgbd: refused a"]
