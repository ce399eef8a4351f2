"""An emulated link: its packets, and TCP to the other side."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from onemap_tools.bench import link as links
from onemap_tools.bench.link import LinkShape, PacketQueue, emulated_link, emulation_problem

RECEIVE = """
import socket, sys
server = socket.create_server((sys.argv[1], 9000))
print("listening", flush=True)
connection, _ = server.accept()
count = 0
while data := connection.recv(65536):
    count += len(data)
print(count, flush=True)
"""
SEND = """
import socket, sys
with socket.create_connection((sys.argv[1], 9000)) as connection:
    connection.sendall(bytes(300_000))
"""


def test_what_is_missing_for_a_link_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    with pytest.raises(ValueError, match="need root"), emulated_link(LinkShape(30e6)):
        pass
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert "apt-get install iproute2" in emulation_problem()
    monkeypatch.setattr(shutil, "which", lambda name: name)
    monkeypatch.setattr(links, "TUN", Path("/nowhere/tun"))
    assert "kernel module tun" in emulation_problem()
    monkeypatch.setattr(sys, "platform", "darwin")
    assert "another system" in emulation_problem()


@pytest.mark.slow
def test_bytes_pass_the_link() -> None:
    if problem := emulation_problem():
        pytest.skip(problem)
    with emulated_link(LinkShape(50e6, 0.002, 0.01)) as link:
        receive = subprocess.Popen(
            [*link.there, sys.executable, "-c", RECEIVE, link.addresses[1]],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert receive.stdout is not None
        assert receive.stdout.readline() == "listening\n"
        subprocess.run([sys.executable, "-c", SEND, link.addresses[1]], check=True, timeout=60)
        output, _ = receive.communicate(timeout=60)
        assert int(output) == 300_000
    kept = subprocess.run(["ip", "netns"], capture_output=True, text=True, check=True).stdout
    assert link.name not in kept


def queue(shape: LinkShape) -> PacketQueue:
    return PacketQueue(shape, np.random.default_rng(1))


def test_packets_take_their_time_and_the_delay_in_their_order() -> None:
    link = queue(LinkShape(8e6, delay_s=0.02))
    for number in range(2):
        link.offer(bytes([number]) * 1000, 5.0)  # a millisecond each at 8 Mbit/s
    assert link.next_s() == pytest.approx(5.021)
    assert link.arrived(5.02) == []
    assert link.arrived(5.0211) == [bytes([0]) * 1000]
    assert link.arrived(5.0221) == [bytes([1]) * 1000]
    assert link.next_s() is None
