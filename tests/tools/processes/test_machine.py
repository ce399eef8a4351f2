"""Ports of this machine, signals, and services that run inside this process."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

from onemap_tools.errors import CliError
from onemap_tools.processes import network


@pytest.mark.parametrize(
    ("endpoint", "local"),
    [
        ("tcp/127.0.0.1:7447", True),
        ("tcp/localhost:7447", True),
        ("tcp/[::1]:7447", True),
        ("tcp/192.168.1.7:7447", False),
        ("tls/robot.local:7448", False),
        ("tcp/127.evil.org:7447", False),
    ],
)
def test_a_router_is_started_here_only_for_local_endpoints(endpoint: str, local: bool) -> None:
    assert network.is_local(endpoint) is local


def test_without_a_free_port_the_option_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[int] = []
    monkeypatch.setattr("onemap_tools.processes.network.is_free", tried.append)
    with pytest.raises(CliError, match="--port"):
        network.next_free_port(9000)
    assert tried == list(range(9000, 9000 + network.TRIED_PORTS))


def test_the_second_signal_abandons_and_exits() -> None:
    code = (
        "import os, signal\n"
        "from onemap_tools.processes.interrupts import interruptible\n"
        "with interruptible(lambda: print('abandoned', flush=True)) as stop:\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    os.kill(os.getpid(), signal.SIGTERM)\n"
        "    print('still here')\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert result.returncode == 128 + signal.SIGTERM
    assert result.stdout == "abandoned\n"
