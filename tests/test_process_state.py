"""A test that changes its process is found, and those after it do not feel it."""

from __future__ import annotations

import logging
import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.process_state import ProcessState

LOG = logging.getLogger("onemap.test_process_state")
LEFT: dict[str, Callable[[Path], object]] = {
    "loggers": lambda _: LOG.setLevel(logging.ERROR),
    "environment": lambda _: os.environ.update(ONEMAP__MAPPER__DEVICE="cuda"),
    "folder": os.chdir,
    "signals": lambda _: signal.signal(signal.SIGTERM, signal.SIG_IGN),
    "thread_hook": lambda _: setattr(threading, "excepthook", print),
}


@pytest.mark.parametrize("name", LEFT)
def test_what_is_left_is_named_and_undone(name: str, tmp_path: Path) -> None:
    before = ProcessState.now()
    LEFT[name](tmp_path)
    assert before.restore() == [name]
    assert ProcessState.now() == before


def test_what_is_taken_away_comes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ONEMAP__MAPPER__DEVICE", "cpu")
    before = ProcessState.now()
    del os.environ["ONEMAP__MAPPER__DEVICE"]
    assert before.restore() == ["environment"]
    assert os.environ["ONEMAP__MAPPER__DEVICE"] == "cpu"


def test_a_new_logger_is_nothing_left() -> None:
    before = ProcessState.now()
    logging.getLogger("onemap.test_process_state.new").warning("hello")
    assert before.restore() == []
