"""Two minutes of the whole loop: memory, descriptors and threads of every process stay flat."""

from __future__ import annotations

import threading
import time
from collections import defaultdict
from dataclasses import dataclass

import psutil
import pytest

from onemap_shared import keys
from tests.chaos.report import BROKEN, HELD, Attack, ChaosResult
from tests.end_to_end.system import START_S, System
from tests.end_to_end.test_faults import absent_object

pytestmark = pytest.mark.timeout(400)

WARM_UP_S, WATCHED_S, SAMPLE_S = 45.0, 120.0, 2.0
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


def samples(system: System, seconds: float, commands: CommandCount) -> dict[str, list[Sample]]:
    """What each process uses, for some time."""
    seen, pause = defaultdict[str, list[Sample]](list), threading.Event()
    deadline_s = time.monotonic() + seconds
    while time.monotonic() < deadline_s:
        for name in system.processes:
            seen[name].append(look(system, name))
        commands.drain()
        pause.wait(SAMPLE_S)
    return seen


def test_two_minutes_of_the_loop(system: System, attack: Attack) -> None:
    system.http.post("/v1/searches", json={"objects": [absent_object(system)]})
    system.until(lambda: system.monitor.moves, "the robot moves", START_S)
    samples(system, WARM_UP_S, CommandCount(system))
    commands = CommandCount(system)
    watched = samples(system, WATCHED_S, commands)
    commands.drain()
    rows = [growth(name, seen) for name, seen in watched.items()]
    heard, gaps, short = commands.lost
    rows.append(
        row(
            "commands",
            "0 lost",  # the robot's count is as old as its heartbeat
            f"{gaps} of {heard} lost, {max(short, 0):.0f} not yet counted by the robot",
            held=gaps == 0 and short <= SLACK,
        )
    )
    attack.hold_all(rows)


def growth(name: str, seen: list[Sample]) -> ChaosResult:
    """What a process took more at the end than at the beginning."""
    tenth = max(len(seen) // 10, 1)
    first = sum(each.own_mb for each in seen[:tenth]) / tenth
    last = sum(each.own_mb for each in seen[-tenth:]) / tenth
    descriptors = max(each.descriptors for each in seen) - seen[0].descriptors
    threads = max(each.threads for each in seen) - seen[0].threads
    allowed = max(GROWTH * first, GROWTH_MB)
    return row(
        name,
        f"+{allowed:.0f} MB, +{MORE} descriptors, +{MORE} threads",
        f"{first:.0f} to {last:.0f} MB, {descriptors:+d} descriptors, {threads:+d} threads",
        held=last - first <= allowed and descriptors <= MORE and threads <= MORE,
    )


def row(name: str, limit: str, measured: str, *, held: bool) -> ChaosResult:
    test = f"{WATCHED_S:g} s of the loop: {name}"
    return ChaosResult(test, limit, measured, HELD if held else BROKEN)
