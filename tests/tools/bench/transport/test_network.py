"""The emulated link between two namespaces, with real TCP."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from onemap_tools.bench.transport import network
from onemap_tools.bench.transport.link_shape import LinkShape
from onemap_tools.bench.transport.network import ADDRESSES, EmulatedLink, emulation_problem

RECEIVE = f"""
import socket
server = socket.create_server(("{ADDRESSES[1]}", 9000))
print("listening", flush=True)
connection, _ = server.accept()
count = 0
while data := connection.recv(65536):
    count += len(data)
print(count, flush=True)
"""
SEND = f"""
import socket
with socket.create_connection(("{ADDRESSES[1]}", 9000)) as connection:
    connection.sendall(bytes(300_000))
"""


@pytest.mark.slow
def test_bytes_pass_the_link_and_are_counted() -> None:
    if problem := emulation_problem():
        pytest.skip(problem)
    with EmulatedLink(LinkShape(50e6, 0.002, 0.01)) as link:
        receive = subprocess.Popen(
            link.command(1, sys.executable, "-c", RECEIVE), stdout=subprocess.PIPE, text=True
        )
        assert receive.stdout is not None
        assert receive.stdout.readline() == "listening\n"
        subprocess.run(link.command(0, sys.executable, "-c", SEND), check=True, timeout=60)
        output, _ = receive.communicate(timeout=60)
        assert int(output) == 300_000
        carried = link.carried()
        assert carried["up"] > 300_000 > carried["down"] > 0
        namespaces = link.names
    kept = subprocess.run(["ip", "netns"], capture_output=True, text=True, check=True).stdout
    assert not any(name in kept for name in namespaces)


def test_what_is_missing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    assert "need root" in emulation_problem()
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert "apt-get install iproute2" in emulation_problem()
    monkeypatch.setattr(shutil, "which", lambda name: name)
    monkeypatch.setattr(network, "TUN", Path("/nowhere/tun"))
    assert "kernel module tun" in emulation_problem()
    monkeypatch.setattr(sys, "platform", "darwin")
    assert "another system" in emulation_problem()
