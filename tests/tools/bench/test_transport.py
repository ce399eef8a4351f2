"""Streams over an emulated link: packets, TCP between namespaces, rates and ages at the map."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from onemap_perception.config import MiniParams
from onemap_tools.bench.options import TransportBench
from onemap_tools.bench.transport import benchmark
from onemap_tools.bench.transport import link as links
from onemap_tools.bench.transport.link import (
    ADDRESSES,
    BUFFER_S,
    LinkShape,
    PacketQueue,
    emulated_link,
    emulation_problem,
)

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
    assert link.carried_bytes == 2000


def test_no_more_arrives_than_the_rate_allows_and_a_full_buffer_drops() -> None:
    link = queue(LinkShape(30e6))
    for number in range(20_000):  # 1 s at 240 Mbit/s
        link.offer(bytes(1500), 10.0 + number / 20_000)
    link.arrived(11.0)
    assert 8 * link.carried_bytes == pytest.approx(30e6, rel=0.01)
    assert link.dropped > 10_000
    burst = queue(LinkShape(100e6))
    for _ in range(2000):
        burst.offer(bytes(1500), 1.0)
    last = 0.0
    while (at := burst.next_s()) is not None:
        last = at
        burst.arrived(at)
    assert last - 1.0 == pytest.approx(BUFFER_S, rel=0.01)


def test_the_share_that_is_lost_is_as_asked_for() -> None:
    link = queue(LinkShape(1e9, loss=0.01))
    for number in range(20_000):
        link.offer(b"x" * 100, float(number))
    assert link.dropped == pytest.approx(200, abs=50)


def test_what_is_missing_for_a_link_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    with pytest.raises(ValueError, match="need root"):
        benchmark.run(TransportBench(link=30.0), lambda _: None)
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert "apt-get install iproute2" in emulation_problem()
    monkeypatch.setattr(shutil, "which", lambda name: name)
    monkeypatch.setattr(links, "TUN", Path("/nowhere/tun"))
    assert "kernel module tun" in emulation_problem()
    monkeypatch.setattr(sys, "platform", "darwin")
    assert "another system" in emulation_problem()


@pytest.mark.slow
def test_bytes_pass_the_link_and_are_counted() -> None:
    if problem := emulation_problem():
        pytest.skip(problem)
    with emulated_link(LinkShape(50e6, 0.002, 0.01)) as link:
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


def counted(ages: list[list[tuple[float, float]]], **metrics: float) -> dict[str, Any]:
    return {
        "mapper": {"streams": [{"ages": each, "metrics": {}} for each in ages]},
        "perception": {"streams": [{"ages": [], "metrics": metrics}]},
        "robot": {"streams": [{"ages": [], "metrics": metrics}]},
    }


def test_rates_and_ages_are_those_of_the_measured_time() -> None:
    first = [(9.0, 5.0), *[(10.0 + 0.1 * i, 0.2) for i in range(20)], (12.5, 5.0)]
    second = [(10.0 + 0.5 * i, 0.4) for i in range(4)]
    row = benchmark.summary(counted([first, second], link_field_replaced=2.0), 10.0, 12.0)
    assert (row["rate_hz"], row["slowest_hz"]) == (6.0, 2.0)
    assert (row["age_p50_ms"], row["age_p95_ms"]) == (200, 400)
    assert (row["replaced"], row["overdue"]) == (4, 0)
    nothing = benchmark.summary(counted([[]]), 0.0, 1.0)
    assert nothing["rate_hz"] == nothing["slowest_hz"] == 0
    assert nothing["age_p50_ms"] is nothing["age_p95_ms"] is None


@pytest.mark.slow
def test_thin_streams_fit_their_links_and_survive_their_file(tmp_path: Path) -> None:
    """The goals: 8 Hz in 30 Mbit/s, and 4 Hz in 10 Mbit/s, each way, with a fifth to spare."""
    full, narrow = (benchmark.make_stream(MiniParams(channels=n), (320, 240), 2) for n in (0, 128))
    full.save(tmp_path / "s.npz")
    loaded = benchmark.load_stream(tmp_path / "s.npz")
    field = loaded.field(loaded.frame(5, 7))
    np.testing.assert_array_equal(field.features, full.features[1])
    assert (field.sequence, field.stamp_ns) == (5, 7)
    for stream, hz, mbit_s in ((full, 8, 30), (narrow, 8, 30), (narrow, 4, 10)):
        for kb in stream.sizes_kb(benchmark.THIN):
            assert 8e-3 * kb * hz < 0.8 * mbit_s
    raw = full.sizes_kb(benchmark.SETTINGS["raw"].link)
    assert 8e-3 * raw[1] * 8 > 2 * 30  # which uncompressed fields do not


@pytest.mark.slow
def test_every_number_of_streams_has_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    """Over loopback where no link can be emulated."""
    monkeypatch.setattr(benchmark, "WARM_UP_S", 1.0)
    link = 0.0 if emulation_problem() else 30.0
    options = TransportBench(
        link=link, setting=["thin"], streams=[2], rate=5.0, seconds=1.0, size="160x120"
    )
    (thin,) = benchmark.run(options, lambda _: None)["results"]
    assert (thin["setting"], thin["streams"]) == ("thin", 2)
    assert thin["slowest_hz"] > 0
    assert thin["age_p50_ms"] > 0
