"""Heartbeats before a service's main loop begins."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from onemap_shared import keys, runner
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.runner import is_starting, long_start

PATIENCE_S = 60.0
WHAT = "compiling the map's kernels"


def test_a_long_start_says_what_it_does_and_advances(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner, "HEARTBEAT_S", 0.01)
    router = MemoryRouter()
    beats = router.bus("gateway").subscribe(keys.heartbeat("mapper"), 8)
    with long_start(router.bus("mapper"), "mapper", WHAT, 45.0):
        first, second = beats.take(PATIENCE_S), beats.take(PATIENCE_S)
    assert first is not None
    assert second is not None
    assert (first.ready, first.problem, is_starting(first)) == (
        False,
        f"{WHAT}: 0 of about 45 s",
        True,
    )
    assert second.progress > first.progress
    assert second.metrics["start_s"] >= first.metrics["start_s"]
    while beats.take(0.0) is not None:
        pass
    assert beats.take(0.1) is None  # over with the block


def test_systemd_is_asked_for_more_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "notify"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(path))
        listener.settimeout(PATIENCE_S)
        monkeypatch.setenv("NOTIFY_SOCKET", str(path))
        with long_start(MemoryRouter().bus("mapper"), "mapper", WHAT, 45.0):
            told = listener.recv(1000).decode()
    assert told == f"EXTEND_TIMEOUT_USEC=30000000\nSTATUS={WHAT}"
