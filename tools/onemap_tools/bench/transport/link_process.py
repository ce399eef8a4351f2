"""Passes packets between two network namespaces, at the rate and with the delay of a link.

``python -m onemap_tools.bench.transport.link_process NAME NAME RATE_BPS DELAY_S LOSS`` makes the
interface ``link0`` in both namespaces, says "ready", and answers every line on its standard input
with the bytes carried each way and the packets dropped.
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import select
import struct
import sys
import time
from contextlib import suppress

import numpy as np

from onemap_tools.bench.transport.link_shape import LinkShape, PacketQueue

TUNSETIFF = 0x400454CA
IFF_TUN, IFF_NO_PI = 0x0001, 0x1000
CLONE_NEWNET = 0x40000000
PACKET_BYTES = 65536
BURST = 64  # packets read before others are written
IDLE_S = 0.5


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


def main(names: tuple[str, str], shape: LinkShape) -> None:
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
    main((sys.argv[1], sys.argv[2]), LinkShape(rate_bps, delay_s, loss))
