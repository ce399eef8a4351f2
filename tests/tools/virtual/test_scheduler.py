"""Virtual time: events, locks, pools, death and stalls, and that the seed decides everything."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import pytest

from onemap_tools.virtual.primitives import VirtualClock
from onemap_tools.virtual.scheduler import NoProgress, VirtualWorld

Run = Callable[[Callable[[VirtualClock], object], float], None]


@pytest.fixture
def world() -> Iterator[VirtualWorld]:
    made = VirtualWorld(7, preempt=0.3)
    yield made
    made.close()


@pytest.fixture
def run(world: VirtualWorld) -> Run:
    """Runs one task of a process until a virtual second."""

    def run_task(work: Callable[[VirtualClock], object], until_s: float) -> None:
        process = world.process("p")
        world.spawn(process, "main", lambda: work(VirtualClock(world, process)))
        world.run(until_s)

    return run_task


def test_waits_end_when_their_time_has_come_and_take_none(world: VirtualWorld, run: Run) -> None:
    ended: list[tuple[str, float, bool]] = []

    def work(clock: VirtualClock) -> None:
        event, condition, lock = clock.event(), clock.condition(), clock.lock()
        began_s = clock.monotonic_s()
        lock.acquire()

        def set_late() -> None:
            clock.sleep(3600.0)
            event.set()
            lock.release()

        clock.thread("late", set_late)
        in_time = event.wait(10.0)
        ended.append(("event", round(clock.monotonic_s() - began_s, 3), in_time))
        with condition:
            ended.append(("notify", 0.0, condition.wait(5.0)))
        ended.append(("lock", 0.0, lock.acquire(timeout=5.0)))
        ended.append(("set", 0.0, event.wait()))
        ended.append(("free", 0.0, lock.acquire()))

    run(work, 4000.0)
    assert ended == [
        ("event", 10.0, False),
        ("notify", 0.0, False),
        ("lock", 0.0, False),
        ("set", 0.0, True),
        ("free", 0.0, True),
    ]
    assert world.now_s == pytest.approx(3600.0, abs=0.001)


def test_one_task_at_a_time_holds_a_lock(run: Run) -> None:
    inside, most, turns = [0], [0], [0]

    def work(clock: VirtualClock) -> None:
        lock, again = clock.lock(), clock.rlock()

        def enter() -> None:
            for _ in range(20):
                with lock, again, again:
                    inside[0] += 1
                    most[0] = max(most[0], inside[0])
                    clock.sleep(0.01)
                    inside[0] -= 1
                    turns[0] += 1

        for thread in [clock.thread(str(number), enter) for number in range(4)]:
            thread.join()

    run(work, 100.0)
    assert (most, turns) == ([1], [80])


def test_locks_and_events_are_as_strict_as_real_ones(run: Run) -> None:
    def work(clock: VirtualClock) -> None:
        lock, again, condition, event = (
            clock.lock(),
            clock.rlock(),
            clock.condition(),
            clock.event(),
        )
        for misused in (lock.release, again.release, condition.notify, condition.wait):
            with pytest.raises(RuntimeError, match="not held"):
                misused()

        def blink() -> None:
            clock.sleep(1.0)
            event.set()
            event.clear()

        clock.thread("blink", blink)
        woken.append(event.wait(5.0))

    woken = list[bool]()
    run(work, 10.0)
    assert woken == [True]


def test_a_pool_answers_refuses_and_ends(run: Run) -> None:
    heard: list[object] = []

    def fail() -> None:
        raise ValueError("no")

    def work(clock: VirtualClock) -> None:
        pool = clock.pool(2, "pool")
        began_s = clock.monotonic_s()
        waits = [pool.submit(clock.sleep, 1.0) for _ in range(4)]
        failed = pool.submit(fail)
        for each in waits:
            each.result()
        heard.append(round(clock.monotonic_s() - began_s, 2))
        heard.append(str(failed.exception()))
        pool.submit(clock.sleep, 1.0)
        pool.submit(clock.sleep, 1.0)
        left_out = pool.submit(clock.sleep, 1.0)
        pool.shutdown(cancel_futures=True)
        heard.append(left_out.cancelled())

    run(work, 100.0)
    assert heard == [2.0, "no", True]


def test_the_dead_do_nothing_and_the_stalled_go_on_later(world: VirtualWorld) -> None:
    said: list[tuple[str, int]] = []
    killed, stalled = world.process("killed"), world.process("stalled")

    def talk(clock: VirtualClock) -> None:
        try:
            while True:
                clock.sleep(1.0)
                said.append((clock.process.name, round(world.now_s)))
        finally:  # which no SIGKILL runs
            clock.event().set()
            said.append(("never", 0))

    for process in (killed, stalled):
        clock = VirtualClock(world, process)
        world.spawn(process, "main", partial(talk, clock))
    world.at(2.5, lambda: world.kill(killed))
    world.at(2.6, lambda: world.stall(stalled, stalled=True))
    world.at(7.6, lambda: world.stall(stalled, stalled=False))
    world.run(9.5)
    assert [at for name, at in said if name == "killed"] == [1, 2]
    assert [at for name, at in said if name == "stalled"] == [1, 2, 8, 9]
    assert "never" not in dict(said)


def test_a_loop_that_waits_for_no_time_is_told(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("onemap_tools.virtual.scheduler.MAX_SWITCHES", 100)

    def give_way(clock: VirtualClock) -> None:
        lock = clock.lock()
        while True:
            with lock:
                pass

    with pytest.raises(NoProgress):
        run(give_way, 1.0)


def test_the_seed_decides_the_order_and_nothing_else_does() -> None:
    def traces(seed: int) -> tuple[int, list[int]]:
        world, order = VirtualWorld(seed, preempt=0.2), list[int]()
        process = world.process("p")
        clock = VirtualClock(world, process)

        def work(number: int) -> None:
            clock.sleep(1.0)
            order.append(number)

        for number in range(6):
            world.spawn(process, str(number), partial(work, number))
        world.run(2.0)
        world.close()
        return world.trace, order

    assert traces(3) == traces(3)
    assert len({tuple(traces(seed)[1]) for seed in range(8)}) > 1
