"""The whole loop for a while: memory, descriptors and threads of every process stay flat.

Two minutes by default; ``--loop-seconds 3600`` watches for an hour.
"""

from __future__ import annotations

import threading
import time
from collections import defaultdict
from contextlib import suppress
from dataclasses import dataclass

import httpx
import psutil

from onemap_shared import keys
from tests.chaos.report import BROKEN, HELD, Attack, ChaosResult
from tests.end_to_end.system import START_S, System, absent_object

WARM_UP_S, SAMPLE_S = 45.0, 2.0
EXPLORED_S = 240.0  # at most, until the map no longer grows
STILL = 1.01  # times the cells of one warm-up before: the map has stopped growing
GROWTH = 0.10  # of the resident memory, or
GROWTH_MB = 24.0  # where that is more; what the map itself holds does not count
MORE = 2  # descriptors or threads
SLACK = 45  # commands of two seconds: the robot's count is as old as its heartbeat


@dataclass(frozen=True, slots=True)
class Sample:
    """One look at a process. ``map_mb``: of the mapper, what it says that its map holds."""

    rss_mb: float
    map_mb: float
    descriptors: int
    threads: int

    @property
    def own_mb(self) -> float:
        """Resident memory without the map."""
        return self.rss_mb - self.map_mb


def look(system: System, name: str) -> Sample:
    process = psutil.Process(system.processes[name].pid)
    map_bytes = 0.0
    if name == "mapper" and name in system.monitor.beats:
        map_bytes = system.monitor.beats[name].metrics.get("memory_bytes", 0.0)
    with process.oneshot():
        return Sample(
            process.memory_info().rss / 1e6,
            map_bytes / 1e6,
            process.num_fds(),
            process.num_threads(),
        )


class CommandCount:
    """Counts the commands on the bus, and those that the robot says it received."""

    def __init__(self, system: System) -> None:
        self._commands = system.monitor.bus.subscribe(keys.ROBOT_CMD_VEL, capacity=512)
        self._beats = system.monitor.beats
        self._before = self._received()

    def _received(self) -> float:
        return self._beats["simulator"].metrics["commands_received"]

    def drain(self) -> None:
        """Take what has arrived."""
        while self._commands.take(0.0) is not None:
            pass

    @property
    def lost(self) -> tuple[int, int, float]:
        """Commands heard, gaps in their sequence, and how many fewer the robot received."""
        counters = self._commands.counters
        return counters.received, counters.missed, counters.received - self.reached

    @property
    def reached(self) -> float:
        """Commands that the robot received, as of its last heartbeat."""
        return self._received() - self._before


class Loop:
    """A system whose robot searches without end."""

    def __init__(self, system: System) -> None:
        self._system, self._absent = system, absent_object(system)
        self.searches = 0
        self.keep_searching()
        system.until(lambda: system.monitor.moves, "the robot moves", START_S)

    def keep_searching(self) -> None:
        """Begin a search if none is active: an apartment is searched in some minutes."""
        http = self._system.http
        with suppress(httpx.TimeoutException):  # of a busy machine: the next sample asks again
            current = http.get("/v1/searches/current")
            if current.status_code == 404 or not current.json().get("active", True):
                started = http.post("/v1/searches", json={"objects": [self._absent]})
                self.searches += started.status_code == 201

    @property
    def cells(self) -> float:
        """Cells of the map, as of the mapper's last heartbeat."""
        return self._system.monitor.beats["mapper"].metrics["cells"]

    def samples(self, seconds: float, commands: CommandCount) -> dict[str, list[Sample]]:
        """What each process uses, for some time."""
        seen, pause = defaultdict[str, list[Sample]](list), threading.Event()
        deadline_s = time.monotonic() + seconds
        while time.monotonic() < deadline_s:
            for name in self._system.processes:
                seen[name].append(look(self._system, name))
            commands.drain()
            self.keep_searching()
            pause.wait(SAMPLE_S)
        return seen

    def warm_up(self) -> None:
        """Go on until the map no longer grows, for a part of its memory is not its own."""
        deadline_s, before = time.monotonic() + EXPLORED_S, 0.0
        while self.cells > STILL * before and time.monotonic() < deadline_s:
            before = self.cells
            self.samples(WARM_UP_S, CommandCount(self._system))


def test_the_loop_stays_flat(system: System, attack: Attack, loop_s: float) -> None:
    loop = Loop(system)
    loop.warm_up()
    commands, cells = CommandCount(system), loop.cells
    watched = loop.samples(loop_s, commands)
    commands.drain()
    what = f"{loop_s:g} s of the loop"
    rows = [growth(f"{what}: {name}", seen) for name, seen in watched.items()]
    heard, gaps, short = commands.lost
    rows.append(
        row(
            f"{what}: commands, {loop.searches} searches, {cells:.0f} to {loop.cells:.0f} cells",
            "0 lost",  # the robot's count is as old as its heartbeat
            f"{gaps} of {heard} lost, {max(short, 0):.0f} not yet counted by the robot",
            held=gaps == 0 and short <= SLACK,
        )
    )
    attack.hold_all(rows)


def growth(test: str, seen: list[Sample]) -> ChaosResult:
    """What a process took more at the end than at the beginning."""
    tenth = max(len(seen) // 10, 1)
    first = sum(each.own_mb for each in seen[:tenth]) / tenth
    last = sum(each.own_mb for each in seen[-tenth:]) / tenth
    descriptors = max(each.descriptors for each in seen) - seen[0].descriptors
    threads = max(each.threads for each in seen) - seen[0].threads
    allowed = max(GROWTH * first, GROWTH_MB)
    return row(
        test,
        f"+{allowed:.0f} MB, +{MORE} descriptors, +{MORE} threads",
        f"{first:.0f} to {last:.0f} MB, {descriptors:+d} descriptors, {threads:+d} threads",
        held=last - first <= allowed and descriptors <= MORE and threads <= MORE,
    )


def row(test: str, limit: str, measured: str, *, held: bool) -> ChaosResult:
    return ChaosResult(test, limit, measured, HELD if held else BROKEN)
