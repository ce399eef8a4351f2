"""The demo as real processes, from its start to its summary; its search is cancelled."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from subprocess import PIPE, STDOUT, Popen, TimeoutExpired
from typing import Any

import httpx
import pytest

from onemap_shared.config import PREFIX
from onemap_tools.processes.network import any_free_port
from tests.end_to_end.system import CHECK_S, HTTP_S, START_S

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


@contextmanager
def demo(folder: Path, *options: str) -> Iterator[tuple[Popen[str], httpx.Client]]:
    """A demo, with few images: the tests are about the composition, not about the search."""
    port = any_free_port()
    command = [sys.executable, "-m", "onemap_tools", "demo", "--headless", "--json", *options]
    limits = ["--time-limit", str(3 * START_S), "--out", str(folder), "--port", str(port)]
    process = Popen(
        [*command, *limits],
        stdout=PIPE,
        stderr=STDOUT,
        text=True,
        env={**os.environ, f"{PREFIX}SIMULATOR__RGBD_HZ": "2"},
    )
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=HTTP_S) as http:
        try:
            yield process, http
        except BaseException:
            process.terminate()
            process.communicate(timeout=START_S)
            raise


def summary_of(process: Popen[str]) -> dict[str, Any]:
    """What a demo whose searches were cancelled says at its end."""
    output, _ = process.communicate(timeout=START_S)
    assert process.returncode == 1, output
    summary: dict[str, Any] = json.loads(output.splitlines()[-1])
    return summary


def get(http: httpx.Client, path: str) -> dict[str, Any]:
    """A document; an empty one while there is none."""
    try:
        found = http.get(path)
    except httpx.TransportError:
        return {}
    document: dict[str, Any] = found.json() if found.status_code == 200 else {}
    return document


def processes_of(folder: Path) -> list[str]:
    """The command lines of the processes that were given a file below the folder."""
    lines = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            lines.append(file.read_bytes().replace(b"\0", b" ").decode())
        except OSError:  # it ended in between
            continue
    return [line for line in lines if f"{folder}/" in line]


def until(true: Callable[[], bool], demo: Popen[str], what: str) -> None:
    deadline_s = time.monotonic() + 3 * START_S
    while not true():
        with suppress(TimeoutExpired):
            demo.wait(CHECK_S)
        assert demo.returncode is None, f"the demo ended; waited for: {what}"
        assert time.monotonic() < deadline_s, f"not in time: {what}"


def test_a_demo_drives_and_ends_with_a_judged_summary(tmp_path: Path) -> None:
    with demo(tmp_path, "--seed", "2", "--objects", "bed") as (process, http):

        def driven_m() -> float:
            return float(get(http, "/v1/searches/current").get("path_length_m", 0.0))

        until(lambda: driven_m() > 1.0, process, "the robot drives")
        assert len(processes_of(tmp_path)) == 6
        http.delete("/v1/searches/current")
        summary = summary_of(process)
    assert [bed["judged"] for bed in summary["objects"]] == [True]
    assert summary["contacts"] is not None
    assert summary["first_metre_s"] > 0
    assert json.loads((Path(summary["folder"]) / "summary.json").read_text()) == summary
    assert processes_of(tmp_path) == []
