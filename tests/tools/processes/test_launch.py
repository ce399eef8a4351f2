"""Starting, supervising and stopping real, small processes; none may be left."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from onemap_shared.runner import PARENT_VARIABLE
from onemap_tools.processes.launch import (
    ENDED,
    Processes,
    ProcessExit,
    ProcessSpec,
    available_cores,
    backoff_s,
    child_environment,
    has_ended,
    running_groups,
    signal_group,
    tail,
    wait_for_groups,
)

SOON_S = 60.0  # a deadline for a loaded machine, not a measure

SLEEPER = "import os, time; print(os.getpid(), flush=True); time.sleep(600)"
STUBBORN = (
    "import os, signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN);"
    "print(os.getpid(), flush=True); time.sleep(600)"
)
PARENT = (
    "import os, subprocess, sys, time;"
    "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)']);"
    "print(os.getpid(), child.pid, flush=True); time.sleep(600)"
)
CRASHING = "print('the reason', flush=True); raise SystemExit(3)"


def python(name: str, code: str, *, last: bool = False) -> ProcessSpec:
    return ProcessSpec(name, (sys.executable, "-c", code), last)


def first_line(log: Path) -> str:
    """The first line of a log, as soon as it is written."""
    deadline = time.monotonic() + SOON_S
    while time.monotonic() < deadline:
        if log.exists() and "\n" in (text := log.read_text()):
            return text.splitlines()[0]
        os.sched_yield()
    raise AssertionError(f"nothing in {log}")


def wait_for_end(processes: Processes, now_s: float) -> ProcessExit:
    deadline = time.monotonic() + SOON_S
    while time.monotonic() < deadline:
        if ended := processes.collect(now_s):
            return ended[0]
        os.sched_yield()
    raise AssertionError("it did not end")


def runs(pid: int) -> bool:
    """Whether a process exists and has not ended."""
    try:
        return psutil.Process(pid).status() not in ENDED
    except psutil.NoSuchProcess:
        return False


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "logs"


def test_all_are_stopped_with_their_child_processes(folder: Path) -> None:
    specs = [python("sleeper", SLEEPER), python("parent", PARENT), python("router", SLEEPER)]
    with Processes(specs, folder) as processes:
        processes.start()
        logs = [folder / f"{spec.name}.log" for spec in specs]
        pids = [int(word) for log in logs for word in first_line(log).split()]
        assert len(set(pids)) == 4
        assert all(runs(pid) for pid in pids)
    assert not any(runs(pid) for pid in pids)


def test_a_child_process_may_end_after_its_parent(folder: Path) -> None:
    """The parent ends at SIGTERM; its child, which takes until then, is not cut off."""
    child = (
        "import os, signal, sys\n"
        "parent = os.getppid()\n"
        "def leave(*_):\n"
        "    while os.getppid() == parent: os.sched_yield()\n"
        "    print('written', flush=True); sys.exit(0)\n"
        "signal.signal(signal.SIGTERM, leave)\n"
        "print('up', flush=True)\n"
        "signal.pause()\n"
    )
    parent = (
        "import subprocess, sys, time;"
        f"subprocess.Popen([sys.executable, '-c', {child!r}]); time.sleep(600)"
    )
    with Processes([python("parent", parent)], folder) as processes:
        processes.start()
        first_line(folder / "parent.log")
    assert tail(folder / "parent.log").splitlines() == ["up", "written"]


def test_a_crash_leaves_no_child_process(folder: Path) -> None:
    code = PARENT.rsplit("time.sleep", 1)[0] + "sys.exit(3)"
    with Processes([python("mapper", code)], folder) as processes:
        processes.start()
        pids = [int(word) for word in first_line(folder / "mapper.log").split()]
        assert wait_for_end(processes, now_s=0.0).code == 3
        assert not any(runs(pid) for pid in pids)


def test_a_process_that_ignores_sigterm_is_killed(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_tools.processes.launch.GRACE_S", 0.05)
    with Processes([python("stubborn", STUBBORN)], folder) as processes:
        processes.start()
        pid = int(first_line(folder / "stubborn.log"))
    assert not runs(pid)


def test_the_router_is_stopped_last(folder: Path) -> None:
    """A process that is stopped while the router still runs can see that it does."""
    watcher = (
        "import os, signal, sys, time\n"
        "def leave(*_):\n"
        "    os.kill(int(open(sys.argv[1]).readline()), 0); print('it runs', flush=True)\n"
        "    sys.exit(0)\n"
        "signal.signal(signal.SIGTERM, leave)\n"
        "print('up', flush=True)\n"
        "time.sleep(600)\n"
    )
    router = "import os, time; print(os.getpid(), flush=True); time.sleep(600)"
    log = str(folder / "router.log")
    specs = [
        python("router", router, last=True),
        ProcessSpec("watcher", (sys.executable, "-c", watcher, log)),
    ]
    with Processes(specs, folder) as processes:
        processes.start()
        first_line(folder / "router.log")
        first_line(folder / "watcher.log")
    assert tail(folder / "watcher.log").splitlines() == ["up", "it runs"]


def test_a_crash_is_reported_once_with_code_and_last_lines(folder: Path) -> None:
    with Processes([python("mapper", CRASHING)], folder) as processes:
        processes.start()
        ended = wait_for_end(processes, now_s=0.0)
        assert (ended.name, ended.code, ended.tail) == ("mapper", 3, "the reason")
        assert ended.sentence == f"mapper ended with code 3; its log is {folder / 'mapper.log'}"
        assert processes.collect(0.0) == []


def test_a_crashed_process_is_restarted_after_its_backoff(folder: Path) -> None:
    with Processes([python("mapper", CRASHING)], folder) as processes:
        processes.start()
        now_s = time.monotonic()
        wait_for_end(processes, now_s)
        assert processes.restart(now_s + 0.9) == []
        assert processes.restart(now_s + 1.1) == ["mapper"]
        wait_for_end(processes, now_s + 2)
        assert processes.restart(now_s + 3.9) == []  # the second pause is twice as long
        assert processes.restart(now_s + 4.1) == ["mapper"]


def test_the_first_start_alone_has_variables_of_its_own(folder: Path) -> None:
    code = "import os; raise SystemExit(3 if os.environ.get('FIRST') else 4)"
    spec = ProcessSpec("mapper", (sys.executable, "-c", code), at_first=(("FIRST", "1"),))
    with Processes([spec], folder) as processes:
        processes.start()
        now_s = time.monotonic()
        assert wait_for_end(processes, now_s).code == 3
        processes.restart(now_s + 1.1)
        assert wait_for_end(processes, now_s + 2).code == 4


def test_kill_ends_all_at_once(folder: Path) -> None:
    with Processes([python("stubborn", STUBBORN)], folder) as processes:
        processes.start()
        first_line(folder / "stubborn.log")
        processes.kill()
        ended = wait_for_end(processes, now_s=0.0)
        assert ended.code == -signal.SIGKILL
        assert "was killed by SIGKILL" in ended.sentence


def test_a_process_stops_when_its_launcher_is_killed(tmp_path: Path) -> None:
    """The launcher gets SIGKILL, which it cannot answer; its service stops by itself."""
    launcher = (
        "import sys; from pathlib import Path; import time\n"
        "from onemap_tools.processes.launch import Processes, ProcessSpec\n"
        "code = 'import threading; from onemap_shared.runner import watch_parent;'\\\n"
        "       'stop = threading.Event(); watch_parent(stop);'\\\n"
        "       'import os; print(os.getpid(), flush=True); stop.wait()'\n"
        "processes = Processes([ProcessSpec('child', (sys.executable, '-c', code))],"
        " Path(sys.argv[1]))\n"
        "processes.start()\n"
        "time.sleep(600)\n"
    )
    parent = subprocess.Popen([sys.executable, "-c", launcher, str(tmp_path)])
    pid = int(first_line(tmp_path / "child.log"))
    parent.kill()
    parent.wait()
    deadline = time.monotonic() + SOON_S
    while runs(pid):
        assert time.monotonic() < deadline, "the child outlives its launcher"
        os.sched_yield()


def test_the_backoff_doubles_up_to_ten_seconds() -> None:
    assert [backoff_s(n) for n in range(1, 7)] == [1, 2, 4, 8, 10, 10]
    assert ProcessExit("planner", 2, Path("planner.log"), "").misconfigured


def test_thread_pools_are_limited_unless_the_user_sets_them() -> None:
    environment = child_environment({"OMP_NUM_THREADS": "7", "HOME": "/root"}, cores=8)
    assert environment["OMP_NUM_THREADS"] == "7"
    assert environment["OPENBLAS_NUM_THREADS"] == "4"
    assert environment["HOME"] == "/root"
    assert environment[PARENT_VARIABLE] == str(os.getpid())
    assert child_environment({}, cores=1)["OMP_NUM_THREADS"] == "1"
    assert available_cores() >= 1


def test_the_tail_of_a_long_log_is_short(tmp_path: Path) -> None:
    log = tmp_path / "x.log"
    log.write_text("\n".join(str(number) for number in range(100_000)))
    assert tail(log, 2).splitlines() == ["99998", "99999"]
    assert tail(tmp_path / "none.log") == ""


def test_a_zombie_does_not_run() -> None:
    """A child that has ended and is not reaped, as by process 1 of many containers."""
    child = subprocess.Popen([sys.executable, "-c", "pass"], start_new_session=True)
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
    os.killpg(child.pid, 0)  # still listed
    assert has_ended(child)
    assert running_groups([child.pid]) == frozenset()
    child.wait()
    assert has_ended(child)
    assert running_groups([child.pid]) == frozenset()


def test_a_group_runs_as_long_as_one_of_its_processes() -> None:
    """The leader has ended and its child runs on."""
    code = (
        "import subprocess, sys;"
        "print(subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)']).pid)"
    )
    leader = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert leader.stdout is not None
    child = int(leader.stdout.readline())
    leader.wait()
    assert running_groups([leader.pid]) == {leader.pid}
    os.kill(child, signal.SIGSTOP)  # a stopped process counts
    assert running_groups([leader.pid]) == {leader.pid}
    os.kill(child, signal.SIGKILL)
    assert wait_for_groups([leader.pid], time.monotonic() + SOON_S)
    leader.stdout.close()


def test_a_signal_reaches_the_whole_group() -> None:
    code = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'input()'])"
    leader = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, start_new_session=True
    )
    signal_group(leader.pid, signal.SIGKILL)
    assert leader.wait(SOON_S) == -signal.SIGKILL
    assert wait_for_groups([leader.pid], time.monotonic() + SOON_S)
    signal_group(leader.pid, signal.SIGTERM)  # none is left: no error
