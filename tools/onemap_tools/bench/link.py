"""A link to a network namespace of this machine: rate, delay, loss, a full buffer.

``emulated_link`` makes the namespace and starts ``python -m onemap_tools.bench.link NAME RATE_BPS
DELAY_S LOSS``, which makes an interface of that name here and there, says "ready", and passes the
packets on until its standard input is closed. Linux, as root.
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import select
import shutil
import struct
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

BUFFER_S = 0.1  # of a full queue, as access points keep it; what comes then is dropped
MIN_BUFFER_BYTES = 64 * 1024  # of slow links: a few packets of every connection
TUN = Path("/dev/net/tun")
TUNSETIFF = 0x400454CA
IFF_TUN, IFF_NO_PI = 0x0001, 0x1000
CLONE_NEWNET = 0x40000000
PACKET_BYTES = 65536
BURST = 64  # packets read before others are written
IDLE_S = 0.5


@dataclass(frozen=True, slots=True)
class LinkShape:
    """One direction of a link. rate_bps: bits per second; delay_s: added to every packet; loss:
    share of packets in [0, 1) that never arrive, drawn one by one."""

    rate_bps: float
    delay_s: float = 0.0
    loss: float = 0.0


@dataclass(slots=True)
class PacketQueue:
    """The packets on one direction of a link. Times are seconds of one monotonic clock."""

    shape: LinkShape
    rng: np.random.Generator
    dropped: int = 0
    _free_s: float = 0.0  # when the last packet has left
    _under_way: deque[tuple[float, bytes]] = field(default_factory=deque)

    def offer(self, packet: bytes, now_s: float) -> None:
        """A packet begins its way, or is dropped."""
        waiting_s = max(self._free_s - now_s, 0.0)
        limit_s = max(BUFFER_S, 8 * MIN_BUFFER_BYTES / self.shape.rate_bps)
        lost = self.shape.loss > 0 and self.rng.random() < self.shape.loss
        if waiting_s > limit_s or lost:
            self.dropped += 1
            return
        self._free_s = now_s + waiting_s + 8 * len(packet) / self.shape.rate_bps
        self._under_way.append((self._free_s + self.shape.delay_s, packet))

    def arrived(self, now_s: float) -> list[bytes]:
        """The packets that arrived since the last call, in their order."""
        packets = []
        while self._under_way and self._under_way[0][0] <= now_s:
            packets.append(self._under_way.popleft()[1])
        return packets

    def next_s(self) -> float | None:
        """When the next packet arrives; None if none is under way."""
        return self._under_way[0][0] if self._under_way else None


def emulation_problem() -> str:
    """Why no link can be emulated here, in one sentence; empty if one can be."""
    if sys.platform != "linux":
        return "links are emulated with Linux' network namespaces; this is another system"
    if os.geteuid() != 0:
        return "emulated links need root, for network namespaces: run it with sudo"
    if shutil.which("ip") is None:
        return "emulated links need the command 'ip': apt-get install iproute2"
    if not TUN.exists():
        return f"emulated links need {TUN}: load the kernel module tun"
    probe = f"onemap-probe-{os.getpid()}"
    try:
        _run("ip", "netns", "add", probe)
        _run("ip", "netns", "del", probe)
    except ValueError as problem:
        return f"network namespaces cannot be made here: {problem}"
    return ""


@dataclass(frozen=True, slots=True)
class EmulatedLink:
    """name: of the namespace, and of the interfaces. addresses: here, and on the other side."""

    name: str
    addresses: tuple[str, str]

    @property
    def there(self) -> tuple[str, ...]:
        """The words that, before a command, run it on the other side."""
        return ("ip", "netns", "exec", self.name)


@contextmanager
def emulated_link(shape: LinkShape) -> Iterator[EmulatedLink]:
    """A link while the context lasts; ValueError where none can be emulated."""
    if problem := emulation_problem():
        raise ValueError(problem)
    name, subnet = f"onemap-{os.getpid()}", f"10.77.{os.getpid() % 256}"
    link = EmulatedLink(name, (f"{subnet}.1", f"{subnet}.2"))
    own, other = link.addresses
    with ExitStack() as stack:
        _run("ip", "netns", "add", name)
        stack.callback(_run, "ip", "netns", "del", name)
        numbers = map(str, (shape.rate_bps, shape.delay_s, shape.loss))
        process = stack.enter_context(
            subprocess.Popen(
                [sys.executable, "-m", __name__, name, *numbers],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
        )
        stack.callback(process.terminate)
        assert process.stdout is not None
        if process.stdout.readline() != "ready\n":
            raise ValueError(f"the link could not be made: is {TUN} allowed here?")
        for before, here, peer in ((), own, other), (link.there, other, own):
            _run(*before, "ip", "addr", "add", here, "peer", peer, "dev", name)
            _run(*before, "ip", "link", "set", name, "up")
        _run(*link.there, "ip", "link", "set", "lo", "up")
        yield link


def _run(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, check=False)
    if done.returncode:
        reason = done.stderr.decode(errors="replace").strip()
        raise ValueError(f"'{' '.join(command)}' failed: {reason}")


def open_interface(name: str) -> int:
    """A descriptor that reads and writes the packets of an interface of this namespace."""
    tun = os.open(TUN, os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(tun, TUNSETIFF, struct.pack("16sH", name.encode(), IFF_TUN | IFF_NO_PI))
    return tun


def enter(namespace: str) -> None:
    """Move this thread to a network namespace."""
    libc = ctypes.CDLL(None, use_errno=True)
    place = os.open(f"/run/netns/{namespace}", os.O_RDONLY)
    if libc.setns(place, CLONE_NEWNET) != 0:
        raise OSError(ctypes.get_errno(), f"cannot enter the namespace {namespace}")
    os.close(place)


def pass_packets(namespace: str, shape: LinkShape) -> None:
    """Pass packets on until standard input is closed."""
    here = open_interface(namespace)
    enter(namespace)
    there = open_interface(namespace)
    rngs = np.random.default_rng(0).spawn(2)
    there_queue, back_queue = (PacketQueue(shape, rng) for rng in rngs)
    ways = ((here, there_queue, there), (there, back_queue, here))
    print("ready", flush=True)
    while True:
        due = [at for _, queue, _ in ways if (at := queue.next_s()) is not None]
        wait_s = max(min(due) - time.monotonic(), 0.0) if due else IDLE_S
        readable, _, _ = select.select([here, there, sys.stdin], [], [], wait_s)
        if sys.stdin in readable:
            return
        for source, queue, sink in ways:
            if source in readable:
                _read(source, queue)
            for packet in queue.arrived(time.monotonic()):
                with suppress(OSError):  # the interface is not up yet, or its queue is full
                    os.write(sink, packet)


def _read(source: int, queue: PacketQueue) -> None:
    with suppress(BlockingIOError):
        for _ in range(BURST):
            queue.offer(os.read(source, PACKET_BYTES), time.monotonic())


if __name__ == "__main__":
    pass_packets(sys.argv[1], LinkShape(*map(float, sys.argv[2:5])))
