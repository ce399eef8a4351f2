"""A service process as its supervisor sees it."""

from __future__ import annotations

import itertools
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from onemap_shared import keys, runner
from onemap_shared.clock import SystemClock
from onemap_shared.runner import SWITCH_S, HeartbeatPublisher, StartReport
from onemap_shared.transport import Health
from onemap_shared.watchdog import LoopProgress
from tests.memory_bus import MemoryRouter
from tests.shared.test_bus import PATIENCE_S, Router, eventually, join, shared_router, space

__all__ = ["shared_router", "space"]  # the fixtures

SERVICE = """
import logging, os, sys, threading, time
from concurrent.futures import ThreadPoolExecutor
from onemap_shared.params import Params
from onemap_shared.runner import ServiceParts, StartError, WorkerFailed, run_service
from onemap_shared.compression import CompressionError
from onemap_shared.transport import Health
from onemap_shared import watchdog

watchdog.HANG_LIMIT_S, watchdog.STOP_LIMIT_S = map(float, sys.argv[1:])
del sys.argv[1:]

class Config(Params):
    mode: str = "good"

class Worker:
    def __init__(self, mode):
        self.mode = mode
        self.waiting = threading.Event()
        ThreadPoolExecutor(1).submit(threading.Event().wait)  # Python's own end would wait for it
        if mode == "thread":
            threading.Thread(target=lambda: 1 / 0, name="helper").start()
    def step(self, timeout_s):
        if self.mode == "crash":
            raise RuntimeError("out of luck")
        if self.mode == "failed":
            raise WorkerFailed("no frame can be encoded")
        if self.mode == "talkative":
            for number in range(3000):
                logging.getLogger("onemap.mapper").error("%d: %s", number, "x" * 500)
        if self.mode == "hang":
            print("hanging", flush=True)
            threading.Event().wait()
        self.waiting.wait(timeout_s)
    def health(self):
        return Health(ready=True, metrics={"answer": 42.0, "switch_s": sys.getswitchinterval()})
    def close(self):
        if self.mode == "hang at the end":
            threading.Event().wait()
        print("closed", flush=True)

def build(bus, config):
    if config.mode == "hang at the start":
        print("building", flush=True)
        threading.Event().wait()
    if config.mode == "unable now":
        raise StartError("the port is in use", temporary=True)
    if config.mode == "unable":
        raise StartError("there is no camera at /dev/video7")
    if config.mode == "no codec":
        raise CompressionError("is a JPEG, which needs OpenCV here")
    return Worker(config.mode)

def load(start):
    if os.environ["ONEMAP__MAPPER__MODE"] == "slow import":
        sys.stdin.read()
    return ServiceParts(Config, build)

run_service("mapper", load, [])
"""


def start(
    router: Router | str,
    mode: str = "good",
    *,
    hang_s: float = PATIENCE_S,
    stop_s: float = PATIENCE_S,
    **environment: str,
) -> subprocess.Popen[str]:
    """A service with these limits of its watchdog: by default a busy machine reaches none."""
    endpoint = router
    if isinstance(router, Router):
        endpoint, environment["ONEMAP__BUS__NAMESPACE"] = router.endpoint, router.namespace
    return subprocess.Popen(
        [sys.executable, "-c", SERVICE, str(hang_s), str(stop_s)],
        env={
            **os.environ,
            "ONEMAP__BUS__CONNECT": f"[{endpoint}]",
            "ONEMAP__MAPPER__MODE": mode,
            **environment,
        },
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_heartbeats_tell_health_and_progress_until_sigterm(space: Router) -> None:
    bus = join(space, "gateway")
    beats = bus.subscribe(keys.heartbeat("mapper"), capacity=8)
    process = start(space)
    first = eventually(lambda: ((beat := beats.take(0.5)) and beat.ready and beat) or None)
    second = eventually(lambda: beats.take(0.5))
    # a thread that computes lets those go on soon that answer
    assert first.metrics == {"answer": 42.0, "switch_s": pytest.approx(SWITCH_S)}
    assert second.progress > first.progress
    process.send_signal(signal.SIGTERM)
    stdout, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    assert "closed" in stdout
    eventually(lambda: True if "mapper" not in bus.alive() else None)
    last = second
    while (beat := beats.take(0.0)) is not None:
        last = beat
    assert (last.ready, last.problem) == (False, "it is stopping")
    bus.close()


@pytest.mark.parametrize(
    ("mode", "message"),
    [
        ("crash", "out of luck"),
        ("thread", "helper died"),
        ("failed", "no frame can be encoded: mapper ends, to be started again"),
    ],
)
def test_a_service_that_dies_ends_its_process(space: Router, mode: str, message: str) -> None:
    process = start(space, mode)
    _, stderr = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    assert message in stderr
    assert ("Traceback" in stderr) is (mode != "failed")


def test_a_main_loop_that_hangs_ends_its_process(space: Router) -> None:
    process = start(space, "hang", hang_s=1.0)
    _, stderr = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    assert "mapper ends, to be restarted: its main loop has made no progress for 1 s" in stderr
    assert "in step" in stderr  # where it stood


def test_a_signal_ends_at_once_what_is_still_built(space: Router) -> None:
    process = start(space, "hang at the start")
    assert process.stdout is not None
    assert process.stdout.readline() == "building\n"
    process.send_signal(signal.SIGTERM)
    stdout, stderr = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, stdout) == (0, "")
    assert "it has not stopped" not in stderr


def test_one_signal_ends_a_service_that_hangs_at_its_end(space: Router) -> None:
    bus = join(space, "gateway")
    beats = bus.subscribe(keys.heartbeat("mapper"), capacity=8)
    process = start(space, "hang at the end", stop_s=1.0)
    eventually(lambda: ((b := beats.take(0.5)) and "answer" in b.metrics) or None)  # it runs
    process.send_signal(signal.SIGTERM)
    _, stderr = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    assert "it has not stopped 1 s after it was told to" in stderr
    bus.close()


@pytest.mark.slow
def test_a_second_process_of_a_service_is_refused_and_the_first_goes_on(space: Router) -> None:
    bus = join(space, "gateway")
    beats = bus.subscribe(keys.heartbeat("mapper"), capacity=8)
    first = start(space)
    instance = eventually(lambda: beats.take(0.5)).instance
    second = start(space)
    _, stderr = second.communicate(timeout=PATIENCE_S)
    assert second.returncode == 1
    assert f"the mapper is not started: mapper {instance} runs on these keys" in stderr
    assert "Traceback" not in stderr
    third = start(space)
    first.kill()
    first.wait()
    taken = eventually(lambda: ((b := beats.take(0.5)) and b.instance != instance) or None)
    assert taken
    third.send_signal(signal.SIGTERM)
    third.communicate(timeout=PATIENCE_S)
    assert third.returncode == 0
    bus.close()


def test_a_service_that_cannot_start_says_why_in_one_sentence(space: Router) -> None:
    for mode, sentence in (
        ("unable", "there is no camera at /dev/video7"),
        ("no codec", "what it sends is a JPEG, which needs OpenCV here"),
    ):
        process = start(space, mode)
        _, stderr = process.communicate(timeout=PATIENCE_S)
        assert process.returncode == 2
        assert sentence in stderr
        assert "Traceback" not in stderr


def test_a_bad_configuration_exits_with_2_and_no_traceback() -> None:
    process = start("tcp/127.0.0.1:1", ONEMAP__MAPPER__MOOD="1")
    _, stderr = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 2
    assert "mapper.mood is unknown; did you mean 'mode'?" in stderr
    assert "Traceback" not in stderr


def test_a_service_stops_when_its_launcher_is_gone_even_while_it_waits() -> None:
    process = start("tcp/127.0.0.1:1", ONEMAP_PARENT_PID="1")
    _, stderr = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    assert "launcher is gone" in stderr


@pytest.fixture
def systemd(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[socket.socket]:
    """The socket to which a process tells systemd how it is."""
    path = tmp_path / "notify"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(path))
        listener.settimeout(PATIENCE_S)
        monkeypatch.setenv("NOTIFY_SOCKET", str(path))
        yield listener


def notices(listener: socket.socket) -> list[str]:
    """The next message to systemd, by line."""
    return listener.recv(1000).decode().splitlines()


def test_systemd_is_told_ready_once_the_service_is_imported(systemd: socket.socket) -> None:
    process = start("tcp/127.0.0.1:1", "slow import")  # no router: a boot does not wait for it
    first, second = notices(systemd), notices(systemd)
    assert first[0] == second[0] == "WATCHDOG=1"
    assert "waiting for a router" in first[1]
    assert process.stdin is not None
    process.stdin.close()
    said = eventually(lambda: ("READY=1" in (lines := notices(systemd)) and lines) or None)
    assert said[1] == "WATCHDOG=1"
    assert "waiting for a router" in said[2]
    process.terminate()
    assert process.wait(PATIENCE_S) == 0


def test_a_container_is_told_while_the_loop_goes_on(space: Router, tmp_path: Path) -> None:
    ready = tmp_path / "ready"
    process = start(
        space,
        ONEMAP_READY_FILE=str(ready),
        ONEMAP__LOG__FORMAT="json",
        JOURNAL_STREAM="8:1",
    )
    eventually(lambda: ready.exists() or None)
    process.terminate()
    _, stderr = process.communicate(timeout=PATIENCE_S)
    lines = stderr.splitlines()  # on a busy machine a warning may be one of them
    assert [line for line in lines if not re.match(r"<[2-7]>\{", line)] == []
    assert lines[-1].startswith("<6>")
    assert json.loads(lines[-1][3:])["message"] == "mapper is down"


def test_a_log_that_nobody_reads_stops_nothing_and_says_what_is_missing(space: Router) -> None:
    bus = join(space, "gateway")
    beats = bus.subscribe(keys.heartbeat("mapper"), capacity=8)
    process = start(space, "talkative")  # more in a step than a pipe and the queue hold
    first = eventually(lambda: ((beat := beats.take(0.5)) and beat.ready and beat) or None)
    second = eventually(lambda: ((b := beats.take(0.5)) and b.progress > first.progress) or None)
    assert second
    process.terminate()
    eventually(lambda: ((b := beats.take(0.5)) and b.problem == "it is stopping") or None)
    _, stderr = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    assert re.search(r"\d+ lines of this log are missing", stderr)
    bus.close()


WHAT = "compiling kernels"


def test_a_watchdog_that_aborts_leaves_where_each_thread_stands(space: Router) -> None:
    process = start(space)
    assert process.stderr is not None
    eventually(lambda: "is up" in process.stderr.readline() or None)  # type: ignore[union-attr]
    process.send_signal(signal.SIGABRT)
    _, stderr = process.communicate(timeout=PATIENCE_S)
    assert "Fatal Python error: Aborted" in stderr


def test_a_key_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    key = tmp_path / "role.key"
    process = start(f"tls/127.0.0.1:1#connect_private_key_file={key}")
    _, stderr = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 2
    assert f"cannot read {key}: No such file or directory" in stderr


def test_a_long_start_says_what_it_does_and_advances() -> None:
    router = MemoryRouter()
    beats = router.bus("gateway").subscribe(keys.heartbeat("mapper"), 8)
    start = StartReport("mapper", SystemClock())
    start.add(router.bus("mapper"))
    with start.takes(WHAT, 45.0):
        first, second = beats.take(PATIENCE_S), beats.take(PATIENCE_S)
    start.publish()
    assert first is not None
    assert second is not None
    assert (first.ready, first.problem) == (False, "it is starting, for 0 s so far")
    assert (second.ready, second.problem) == (False, f"{WHAT}: 0 of about 45 s")
    assert first.starting
    assert second.starting
    assert second.progress > first.progress
    third = beats.take(PATIENCE_S)
    assert third is not None
    assert third.problem == first.problem


def test_a_worker_that_is_ready_says_so_before_the_next_heartbeat_is_due(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(runner, "HEARTBEAT_S", 10 * PATIENCE_S)
    told, stop, bus = itertools.count(), threading.Event(), MemoryRouter().bus("mapper")

    class Loading:
        def step(self, _timeout_s: float) -> None: ...
        def close(self) -> None: ...
        def health(self) -> Health:
            return Health(ready=next(told) > 1)

    beats = bus.subscribe(keys.heartbeat("mapper"), 8)
    publisher = HeartbeatPublisher("mapper", bus, LoopProgress())
    thread = threading.Thread(target=publisher.run, args=(Loading(), stop))
    thread.start()
    first, second = beats.take(PATIENCE_S), beats.take(PATIENCE_S)
    stop.set()
    thread.join()
    assert first is not None
    assert second is not None
    assert (first.ready, second.ready) == (False, True)


def test_systemd_is_asked_for_more_time(systemd: socket.socket) -> None:
    with StartReport("mapper", SystemClock()).takes(WHAT, 45.0):
        pass
    assert notices(systemd) == [
        "EXTEND_TIMEOUT_USEC=30000000",
        "WATCHDOG=1",
        f"STATUS={WHAT}: 0 of about 45 s",
    ]
