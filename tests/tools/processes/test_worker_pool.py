"""Processes that compute for another end with it: real ones, in every way to die."""

from __future__ import annotations

import ast
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from onemap_tools.processes.launch import ENDED
from tests.shared.test_bus import eventually
from tests.structure import ROOT, modules

WORKERS = 2
POOL = """
import os, threading
from onemap_tools.processes.worker_pool import worker_pool

def compute(_):
    while True:
        pass

if __name__ == "__main__":
    with worker_pool(2) as pool:
        list(pool.map(compute, range(3)))
"""


def descendants(pid: int) -> set[psutil.Process]:
    return set(psutil.Process(pid).children(recursive=True))


def workers(pid: int) -> set[psutil.Process] | None:
    """The workers of a process once all of them run; None before."""
    found = {each for each in descendants(pid) if "spawn_main" in " ".join(each.cmdline())}
    return found if len(found) == WORKERS else None


def runs(process: psutil.Process) -> bool:
    try:
        return process.is_running() and process.status() not in ENDED
    except psutil.NoSuchProcess:
        return False


@pytest.fixture
def script(tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A process with workers that compute for ever."""
    file = tmp_path / "pool.py"
    file.write_text(POOL, encoding="utf-8")
    process = subprocess.Popen([sys.executable, str(file)])
    yield process
    process.kill()
    process.wait()


@pytest.mark.parametrize("death", [signal.SIGKILL, signal.SIGTERM])
def test_workers_that_compute_end_with_their_parent(
    script: subprocess.Popen[bytes], death: signal.Signals
) -> None:
    assert eventually(lambda: workers(script.pid))
    left = descendants(script.pid)
    script.send_signal(death)
    script.wait()
    try:
        assert eventually(lambda: not any(map(runs, left)) or None)
    finally:
        for each in left:
            if runs(each):
                each.kill()


def test_no_other_pool_is_made() -> None:
    """One that does not watch its parent would leave processes behind."""
    named = {
        module.name
        for module in modules(ROOT)
        for node in ast.walk(module.tree)
        if isinstance(node, ast.alias) and node.name in ("ProcessPoolExecutor", "Pool")
    }
    assert named == {"onemap_tools.processes.worker_pool"}
