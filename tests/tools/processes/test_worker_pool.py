"""Processes that compute for another end with it: real ones, in every way to die."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from onemap_tools.processes.worker_pool import THREAD_VARIABLES, worker_pool
from tests.shared.test_bus import eventually

POOL = """
from onemap_tools.processes.worker_pool import worker_pool

def compute(_):
    while True:
        pass

if __name__ == "__main__":
    with worker_pool(2) as pool:
        list(pool.map(compute, range(3)))
"""

ENDED = (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD)


def runs(process: psutil.Process) -> bool:
    try:
        return process.is_running() and process.status() not in ENDED
    except psutil.NoSuchProcess:
        return False


@pytest.mark.parametrize("death", [signal.SIGKILL, signal.SIGTERM])
def test_workers_that_compute_end_with_their_parent(death: signal.Signals, tmp_path: Path) -> None:
    file = tmp_path / "pool.py"
    file.write_text(POOL, encoding="utf-8")
    parent = subprocess.Popen([sys.executable, str(file)])

    def workers() -> list[psutil.Process] | None:
        """All that it has started, once both workers run; None before."""
        left = psutil.Process(parent.pid).children(recursive=True)
        spawned = [each for each in left if "spawn_main" in " ".join(each.cmdline())]
        return left if len(spawned) == 2 else None

    left = eventually(workers)
    parent.send_signal(death)
    parent.wait()
    try:
        assert eventually(lambda: not any(map(runs, left)) or None)
    finally:
        for each in filter(runs, left):
            each.kill()


def variables_of_worker(_: int) -> list[str | None]:
    return [os.environ.get(each) for each in THREAD_VARIABLES]


def test_a_worker_computes_with_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    for each in THREAD_VARIABLES:
        monkeypatch.delenv(each, raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")  # somebody's wish
    with worker_pool(1) as pool:
        (inherited,) = pool.map(variables_of_worker, range(1))
    assert inherited == ["3", "1", "1"]
    assert variables_of_worker(0) == ["3", None, None]
