"""A virtual disk: what was synced is there after a cut of power, what was not may be torn."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from onemap_shared.atomic_file import appending, move, remove, replacing, sweep_leftovers
from onemap_tools.virtual.disk import VirtualDisk
from onemap_tools.virtual.scheduler import Process, VirtualWorld

OLD, NEW = b"old" * 9, b"new" * 100_000  # 1.5 ms of writing


def write(path: Path, data: bytes) -> None:
    with replacing(path) as file:
        file.write(data)


def write_in_place(path: Path, data: bytes) -> None:
    with path.open("a+b") as file:
        file.truncate(0)
        file.write(data)


class Machine:
    """A computer with a disk and a process."""

    def __init__(self, seed: int) -> None:
        self.world = VirtualWorld(seed)
        self.disk = VirtualDisk(self.world, "mapper")
        self.path = self.disk.root / "maps" / "x.npz"

    def run(self, work: Callable[[], object], until_s: float = 60.0) -> Process:
        process = self.world.process("mapper")
        self.world.spawn(process, "work", work)
        self.world.run(self.world.now_s + until_s)
        assert self.world.crashes == []
        return process


@pytest.fixture
def machines() -> Iterator[list[Machine]]:
    made = [Machine(seed) for seed in range(30)]
    yield made
    for machine in made:
        machine.world.close()


def after_power(machine: Machine, work: Callable[[Path, bytes], None], cut_s: float) -> bytes:
    """What is there after power went while the new file was written over the old one."""
    machine.run(lambda: write(machine.path, OLD))
    process = machine.run(lambda: work(machine.path, NEW), cut_s)
    machine.world.kill(process)
    machine.disk.lose_power()
    return machine.path.read_bytes() if machine.path.exists() else b""


def test_what_is_replaced_is_whole_at_any_cut(machines: list[Machine]) -> None:
    cuts = [after_power(each, write, 0.0005 * step) for step, each in enumerate(machines)]
    assert set(cuts) == {OLD, NEW}
    assert cuts[-1] == NEW


def test_what_is_written_in_place_is_torn(machines: list[Machine]) -> None:
    found = [after_power(each, write_in_place, 1.0) for each in machines]
    assert any(each not in (OLD, NEW) for each in found)


def test_a_name_that_was_not_synced_may_be_lost(machines: list[Machine]) -> None:
    def unsynced(path: Path) -> None:
        with path.open("xb") as file:
            file.write(OLD)

    there = []
    for machine in machines:
        machine.run(partial(unsynced, machine.path))
        machine.disk.lose_power()
        there.append(machine.path.exists())
    assert {*there} == {True, False}


def test_a_full_disk_leaves_the_file_before(machines: list[Machine]) -> None:
    machine, refused = machines[0], list[str]()

    def work() -> None:
        write(machine.path, OLD)
        machine.disk.full = True
        try:
            write(machine.path, NEW)
        except OSError as problem:
            refused.append(str(problem.strerror))

    machine.run(work)
    assert refused == ["No space left on device"]
    assert machine.path.read_bytes() == OLD
    assert [path.name for path in machine.path.parent.glob("*")] == ["x.npz"]


def test_a_slow_disk_takes_its_time(machines: list[Machine]) -> None:
    machine = machines[0]
    machine.disk.slower = 500.0
    machine.run(lambda: write(machine.path, NEW), 1.0)
    assert not machine.path.exists()


def test_files_are_appended_moved_listed_and_removed(machines: list[Machine]) -> None:
    machine, log = machines[0], machines[0].disk.root / "log"

    def work() -> None:
        for line in (b"one\n", b"two\n"):
            with appending(log) as file:
                file.write(line)
        move(log, log.with_name("moved"))
        write(log.with_name(".x.part"), OLD)
        assert sweep_leftovers(log.parent) == 1
        remove(log.with_name("nothing"))

    machine.run(work)
    machine.disk.lose_power()
    assert [(path.name, path.read_bytes()) for path in log.parent.glob("*")] == [
        ("moved", b"one\ntwo\n")
    ]
    assert log.with_name("moved").stat().st_size == 8


def test_arrays_are_read_from_it(machines: list[Machine]) -> None:
    machine = machines[0]

    def work() -> None:
        with replacing(machine.path) as file:
            np.savez(file, numbers=np.arange(1000))
        with machine.path.open("rb") as file, np.load(file) as kept:
            assert kept["numbers"].sum() == 499_500

    machine.run(work)
