"""A router and services as real processes, and a monitor on their bus.

Waits end with the next message; conditions that no message reports (HTTP, a process that
ended) are checked again every ``CHECK_S``.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

import httpx
import yaml

from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.bus import open_bus
from onemap_shared.config import PREFIX, BusConfig
from onemap_shared.keys import Topic
from onemap_shared.services import SERVICES
from onemap_shared.transport import Bus
from onemap_tools.processes.launch import child_environment, onemap_command, tail
from onemap_tools.processes.network import any_free_port

M = TypeVar("M")

CHECK_S = 0.1
START_S = 240.0  # from the start to a map that is updated: 10 s on two idle cores
PATIENCE_S = 90.0  # for what takes a second on an idle machine
HTTP_S = 60.0  # the gateway answers within 2.5 s; less would be a measure of the machine
STANDSTILL = 10  # odometry messages in a row: half a second
MOVING_MPS = 0.02  # and rad/s; below the robot stands still
RARE = ("guitar", "bicycle", "suitcase", "teddy bear", "washing machine", "piano")


class BusMonitor:
    """Keeps the newest message of the small streams; ``until`` waits for a condition on them."""

    def __init__(self, bus: Bus) -> None:
        self.beats: dict[str, m.Heartbeat] = {}
        self.odometry: deque[m.Odometry] = deque(maxlen=STANDSTILL)
        self.revision: m.MapRevision | None = None
        self.search: m.SearchStatus | None = None
        self.bus = bus
        self.recorded: list[m.Odometry] | None = None  # all odometry from when it is a list
        self._changed = threading.Condition()
        self._closing = threading.Event()
        self._threads = [
            self._follow(keys.ALL_HEARTBEATS, self._on_beat),
            self._follow(keys.ROBOT_ODOMETRY, self._on_odometry),
            self._follow(keys.MAP_REVISION, lambda message: setattr(self, "revision", message)),
            self._follow(keys.SEARCH_STATE, lambda message: setattr(self, "search", message)),
        ]

    @property
    def alive(self) -> frozenset[str]:
        """The services whose process is connected, without this monitor."""
        return self.bus.alive() - {"monitor"}

    @property
    def moves(self) -> bool:
        """Whether the robot moved at any of the last odometry messages."""
        return any(
            abs(message.linear_mps) > MOVING_MPS or abs(message.angular_radps) > MOVING_MPS
            for message in list(self.odometry)
        )

    @property
    def stands(self) -> bool:
        """Whether the robot has stood still for half a second of odometry."""
        return len(self.odometry) == STANDSTILL and not self.moves

    def until(self, true: Callable[[], Any], what: str, within_s: float = PATIENCE_S) -> None:
        """Return as soon as ``true()`` holds, or fail."""
        deadline = time.monotonic() + within_s
        while not true():
            if time.monotonic() > deadline:
                raise AssertionError(f"not within {within_s:g} s: {what}")
            with self._changed:
                self._changed.wait(CHECK_S)

    def close(self) -> None:
        """Stop the threads and leave the bus."""
        self._closing.set()
        for thread in self._threads:
            thread.join(2.0)
        self.bus.close()

    def _on_odometry(self, message: m.Odometry) -> None:
        self.odometry.append(message)
        if self.recorded is not None:
            self.recorded.append(message)

    def _on_beat(self, beat: m.Heartbeat) -> None:
        self.beats[beat.service] = beat

    def _follow(self, topic: Topic[M], use: Callable[[M], object]) -> threading.Thread:
        subscription = self.bus.subscribe(topic, capacity=16)

        def run() -> None:
            while not self._closing.is_set():
                message = subscription.take(0.5)
                if message is not None:
                    with self._changed:
                        use(message)
                        self._changed.notify_all()

        thread = threading.Thread(target=run, name=topic.key, daemon=True)
        thread.start()
        return thread


class System:
    """The processes of one test; a context manager that stops them all at its end.

    ``sections`` are added to the configuration; ports and folders belong to this test.
    """

    def __init__(
        self, folder: Path, services: Sequence[str], sections: Mapping[str, dict[str, Any]]
    ) -> None:
        self.folder = folder
        self.services = tuple(services)
        self.endpoint = f"tcp/127.0.0.1:{any_free_port()}"
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        port = any_free_port()
        self.configuration = folder / "system.yaml"
        content: dict[str, dict[str, Any]] = {
            "bus": {"connect": [self.endpoint]},
            "gateway": {"port": port},
            "mapper": {"map_folder": str(folder / "maps")},
            "planner": {"state_dir": str(folder / "planner")},
        }
        for name, section in sections.items():
            content.setdefault(name, {}).update(section)
        self.configuration.write_text(yaml.safe_dump(content), encoding="utf-8")
        clean = {key: value for key, value in os.environ.items() if not key.startswith(PREFIX)}
        self.environment = child_environment(clean)
        self.http = httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=HTTP_S)

    def __enter__(self) -> System:
        self.start("router")
        bus = open_bus(BusConfig(connect=(self.endpoint,)), "monitor", "w", threading.Event())
        assert bus is not None
        self.monitor = BusMonitor(bus)
        for name in self.services:
            self.start(name)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        problem: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.http.close()
        self.monitor.close()
        for name in [*self.services, "router"]:
            self.resume(name)
            self.processes[name].terminate()
        for process in self.processes.values():
            try:
                process.wait(30.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def start(self, name: str, **variables: str) -> None:
        """Start a service, or start it again, at its usual speed: coverage is not measured.

        variables: of its environment, beside those of all.
        """
        command = (
            onemap_command("router", "--listen", self.endpoint)
            if name == "router"
            else (sys.executable, "-m", SERVICES[name].module, "--config", str(self.configuration))
        )
        with self.log(name).open("ab") as log:
            self.processes[name] = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={
                    **{k: v for k, v in self.environment.items() if not k.startswith("COVERAGE_")},
                    **variables,
                },
            )

    def onemap(self, *arguments: str, config: bool = True) -> subprocess.CompletedProcess[str]:
        """Run an ``onemap`` command with this system's configuration."""
        configured = ("--config", str(self.configuration)) if config else ()
        return subprocess.run(
            onemap_command(*arguments, *configured),
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )

    def kill(self, name: str) -> None:
        """SIGKILL: the process ends without a message."""
        self.processes[name].kill()
        self.processes[name].wait()
        self.monitor.odometry.clear()

    def suspend(self, name: str) -> None:
        """SIGSTOP: the process exists and does nothing."""
        self.processes[name].send_signal(signal.SIGSTOP)
        self.monitor.odometry.clear()

    def resume(self, name: str) -> None:
        """Undo ``suspend``."""
        self.processes[name].send_signal(signal.SIGCONT)

    def restore(self) -> None:
        """Start the processes that ended and wait until the system is ready, before a test."""
        for name, process in self.processes.items():
            self.resume(name)
            if process.poll() is not None:
                self.start(name)
        self.until(self.is_ready, "the system is ready", START_S)

    def log(self, name: str) -> Path:
        """The log file of a service."""
        return self.folder / f"{name}.log"

    def until(self, true: Callable[[], Any], what: str, within_s: float = PATIENCE_S) -> None:
        """As ``BusMonitor.until``; fails when a process ends, with the end of every log."""

        def true_and_all_run() -> object:
            gone = [name for name, each in self.processes.items() if (each.poll() or 0) > 0]
            assert not gone, f"{', '.join(gone)} ended; waited for: {what}"
            return true()

        try:
            self.monitor.until(true_and_all_run, what, within_s)
        except AssertionError as failure:
            logs = "\n".join(
                f"--- {name} ({process.poll()})\n{tail(self.log(name))}"
                for name, process in self.processes.items()
            )
            raise AssertionError(f"{failure}\n{self.ready()}\n{logs}") from None

    def ready(self) -> httpx.Response | None:
        """The reply of /readyz; None without a gateway."""
        try:
            return self.http.get("/readyz")
        except httpx.TransportError:
            return None

    def is_ready(self) -> bool:
        """Whether frames reach the map."""
        answer = self.ready()
        return answer is not None and answer.status_code == 200

    def lacks(self, service: str) -> bool:
        """Whether /readyz reports that this service is missing."""
        answer = self.ready()
        return (
            answer is not None and answer.status_code == 503 and answer.json()["service"] == service
        )


def absent_object(system: System) -> str:
    """An object that the scene does not have: a search for it goes on for long."""
    request = m.TruthRequest(RARE[0], 0.0, 0.0)
    categories = system.monitor.bus.call(keys.ROBOT_TRUTH, request, PATIENCE_S).categories
    return next(name for name in RARE if name not in categories)
