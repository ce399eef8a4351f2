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
from onemap_tools.processes import launch
from tests.shared.test_bus import eventually

SLEEPER = "import os, time; print(os.getpid(), flush=True); time.sleep(600)"
STUBBORN = f"import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); {SLEEPER}"
PARENT = (
    "import os, subprocess, sys, time;"
    "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)']);"
    "print(os.getpid(), child.pid, flush=True); "
)


def python(name: str, code: str, *, last: bool = False) -> launch.ProcessSpec:
    return launch.ProcessSpec(name, (sys.executable, "-c", code), last)


def first_line(log: Path) -> str:
    """The first line of a log, as soon as it is written."""

    def read() -> str | None:
        text = log.read_text() if log.exists() else ""
        return text.splitlines()[0] if "\n" in text else None

    return eventually(read)


def ended(processes: launch.Processes, now_s: float) -> launch.ProcessExit:
    return eventually(lambda: next(iter(processes.collect(now_s)), None))


def runs(pid: int) -> bool:
    """Whether a process exists and has not ended."""
    try:
        return psutil.Process(pid).status() not in (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD)
    except psutil.NoSuchProcess:
        return False


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "logs"


def test_all_are_stopped_with_their_child_processes(folder: Path) -> None:
    specs = [python("sleeper", SLEEPER), python("parent", f"{PARENT} time.sleep(600)")]
    with launch.Processes(specs, folder) as processes:
        processes.start()
        logs = [folder / f"{spec.name}.log" for spec in specs]
        pids = [int(word) for log in logs for word in first_line(log).split()]
        assert len(set(pids)) == 3
        assert all(runs(pid) for pid in pids)
    assert eventually(lambda: not any(runs(pid) for pid in pids) or None)


def test_a_process_that_ignores_sigterm_is_killed(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_tools.processes.launch.GRACE_S", 0.05)
    with launch.Processes([python("stubborn", STUBBORN)], folder) as processes:
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
    command = (sys.executable, "-c", watcher, str(folder / "router.log"))
    specs = [python("router", SLEEPER, last=True), launch.ProcessSpec("watcher", command)]
    with launch.Processes(specs, folder) as processes:
        processes.start()
        for spec in specs:
            first_line(folder / f"{spec.name}.log")
    assert launch.tail(folder / "watcher.log").splitlines() == ["up", "it runs"]


def test_a_crash_is_reported_once_and_leaves_no_child_process(folder: Path) -> None:
    with launch.Processes([python("mapper", f"{PARENT} sys.exit(3)")], folder) as processes:
        processes.start()
        pids = [int(word) for word in first_line(folder / "mapper.log").split()]
        crash = ended(processes, now_s=0.0)
        assert eventually(lambda: not any(runs(pid) for pid in pids) or None)
        assert (crash.name, crash.code, crash.first) == ("mapper", 3, True)
        log = folder / "mapper.log"
        said = f"mapper ended with code 3; its log is {log}. Its last lines:\n{launch.tail(log)}"
        assert crash.report == said
        assert processes.collect(0.0) == []


def test_a_crashed_process_is_restarted_after_a_pause(folder: Path) -> None:
    with launch.Processes([python("mapper", "raise SystemExit(4)")], folder) as processes:
        processes.start()
        now_s = time.monotonic()
        for _ in range(2):
            crash = ended(processes, now_s)
            assert (crash.code, crash.misconfigured) == (4, False)
            assert processes.restart(now_s + launch.RESTART_S - 0.1) == []
            now_s += launch.RESTART_S + 0.1
            assert processes.restart(now_s) == ["mapper"]


def test_kill_ends_all_at_once(folder: Path) -> None:
    with launch.Processes([python("stubborn", STUBBORN)], folder) as processes:
        processes.start()
        first_line(folder / "stubborn.log")
        processes.kill()
        killed = ended(processes, now_s=0.0)
        assert killed.code == -signal.SIGKILL
        assert "was killed by SIGKILL" in killed.report


def test_a_process_stops_when_its_launcher_is_killed(tmp_path: Path) -> None:
    """The launcher gets SIGKILL, which it cannot answer; its service stops by itself."""
    service = (
        "import os, threading; from onemap_shared.runner import watch_parent;"
        "stop = threading.Event(); watch_parent(stop); print(os.getpid(), flush=True); stop.wait()"
    )
    launcher = (
        "import sys, time; from pathlib import Path\n"
        "from onemap_tools.processes.launch import Processes, ProcessSpec\n"
        f"spec = ProcessSpec('child', (sys.executable, '-c', {service!r}))\n"
        "Processes([spec], Path(sys.argv[1])).start()\n"
        "time.sleep(600)\n"
    )
    parent = subprocess.Popen([sys.executable, "-c", launcher, str(tmp_path)])
    pid = int(first_line(tmp_path / "child.log"))
    parent.kill()
    parent.wait()
    assert eventually(lambda: not runs(pid) or None)


def test_thread_pools_are_limited_unless_the_user_sets_them() -> None:
    environment = launch.child_environment({"OMP_NUM_THREADS": "77", "HOME": "/root"})
    half = max(1, len(os.sched_getaffinity(0)) // 2)
    assert environment["OMP_NUM_THREADS"] == "77"
    assert environment["OPENBLAS_NUM_THREADS"] == str(half)
    assert environment["HOME"] == "/root"
    assert environment[PARENT_VARIABLE] == str(os.getpid())


def test_the_tail_of_a_long_log_is_short(tmp_path: Path) -> None:
    log = tmp_path / "x.log"
    log.write_text("\n".join(str(number) for number in range(100_000)))
    assert launch.tail(log, 2).splitlines() == ["99998", "99999"]
    assert launch.tail(tmp_path / "none.log") == ""
