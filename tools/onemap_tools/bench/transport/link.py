"""A link between two network namespaces of this machine: rate, delay, loss, a full buffer.

``emulated_link`` makes the namespaces and starts ``python -m onemap_tools.bench.transport.link NAME
NAME RATE_BPS DELAY_S LOSS``, which makes the interface ``link0`` in both, says "ready", passes the
packets on, and answers every line on its standard input with the bytes carried each way and the
packets dropped. Linux, as root.
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
ADDRESSES = ("10.77.0.1", "10.77.0.2")  # of the robot's side and the other one
CONGESTION_CONTROL = "/proc/sys/net/ipv4/tcp_congestion_control"
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
    carried_bytes: int = 0
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
            self.carried_bytes += len(packets[-1])
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
    """Two namespaces, and the process that passes packets between them."""

    names: tuple[str, str]
    process: subprocess.Popen[str]

    def command(self, side: int, *command: str) -> tuple[str, ...]:
        """A command line that runs ``command`` in the namespace of side 0 or 1."""
        return ("ip", "netns", "exec", self.names[side], *command)

    def carried(self) -> dict[str, int]:
        """Bytes from side 0 to 1 (``up``) and back (``down``) so far, and packets dropped."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        counts = map(int, self.process.stdout.readline().split())
        return dict(zip(("up", "down", "dropped"), counts, strict=True))


@contextmanager
def emulated_link(shape: LinkShape, congestion_control: str = "") -> Iterator[EmulatedLink]:
    """A link while the context lasts.

    ``congestion_control`` of TCP in both namespaces, for example cubic; empty: the machine's.
    ValueError where no link can be emulated.
    """
    names = (f"onemap-{os.getpid()}-a", f"onemap-{os.getpid()}-b")
    with ExitStack() as stack:
        for name in names:
            _run("ip", "netns", "add", name)
            stack.callback(_run, "ip", "netns", "del", name)
            _run("ip", "-n", name, "link", "set", "lo", "up")
        numbers = map(str, (shape.rate_bps, shape.delay_s, shape.loss))
        command = [sys.executable, "-m", f"{__package__}.link", *names, *numbers]
        process = stack.enter_context(
            subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        )
        stack.callback(process.terminate)
        assert process.stdout is not None
        if process.stdout.readline() != "ready\n":
            raise ValueError(f"the link could not be made: is {TUN} allowed here?")
        for name, own, other in zip(names, ADDRESSES, reversed(ADDRESSES), strict=True):
            _run("ip", "-n", name, "addr", "add", own, "peer", other, "dev", "link0")
            _run("ip", "-n", name, "link", "set", "link0", "up")
            if congestion_control:
                write = f"echo {congestion_control} > {CONGESTION_CONTROL}"
                _run("ip", "netns", "exec", name, "sh", "-c", write)
        yield EmulatedLink(names, process)


def _run(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, check=False)
    if done.returncode:
        reason = done.stderr.decode(errors="replace").strip()
        raise ValueError(f"'{' '.join(command)}' failed: {reason}")


def open_interface(namespace: str) -> int:
    """A descriptor that reads and writes the packets of ``link0`` in a namespace."""
    libc = ctypes.CDLL(None, use_errno=True)
    place = os.open(f"/run/netns/{namespace}", os.O_RDONLY)
    if libc.setns(place, CLONE_NEWNET) != 0:
        raise OSError(ctypes.get_errno(), f"cannot enter the namespace {namespace}")
    os.close(place)
    tun = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(tun, TUNSETIFF, struct.pack("16sH", b"link0", IFF_TUN | IFF_NO_PI))
    return tun


def pass_packets(names: tuple[str, str], shape: LinkShape) -> None:
    """Pass packets on until standard input is closed."""
    ends = [open_interface(name) for name in names]
    rngs = np.random.default_rng(0).spawn(2)
    up, down = (PacketQueue(shape, rng) for rng in rngs)
    ways = ((ends[0], up, ends[1]), (ends[1], down, ends[0]))
    print("ready", flush=True)
    while True:
        due = [at for _, queue, _ in ways if (at := queue.next_s()) is not None]
        wait_s = max(min(due) - time.monotonic(), 0.0) if due else IDLE_S
        readable, _, _ = select.select([*ends, sys.stdin], [], [], wait_s)
        if sys.stdin in readable:
            if not sys.stdin.readline():
                return
            print(up.carried_bytes, down.carried_bytes, up.dropped + down.dropped, flush=True)
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
    rate_bps, delay_s, loss = map(float, sys.argv[3:6])
    pass_packets((sys.argv[1], sys.argv[2]), LinkShape(rate_bps, delay_s, loss))
