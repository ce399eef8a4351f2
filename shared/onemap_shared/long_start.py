"""Heartbeats of a service whose start takes long, before the runner publishes any."""
# Talks: publishes from a thread.

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import sdnotify

from onemap_shared.keys import heartbeat
from onemap_shared.messages import Heartbeat
from onemap_shared.runner import HEARTBEAT_S
from onemap_shared.transport import Bus

START_S = "start_s"  # metric: seconds that the start has taken so far; absent once it is over
MORE_TIME_US = 30_000_000  # asked of systemd with every heartbeat, beyond TimeoutStartSec


@contextmanager
def long_start(bus: Bus, service: str, what: str) -> Iterator[None]:
    """Publish once a second until the block ends that the service is not ready, and why.

    what: one sentence. The heartbeats' progress counts them: the main loop has not begun yet.
    systemd is asked for more time, so that it does not end what advances.
    """
    done = threading.Event()
    publisher = bus.publish(heartbeat(service))
    systemd = sdnotify.SystemdNotifier()
    began_s = time.monotonic()

    def beat(count: int) -> None:
        systemd.notify(f"EXTEND_TIMEOUT_USEC={MORE_TIME_US}\nSTATUS={what}")
        publisher.put(
            Heartbeat(
                service=service,
                instance=bus.instance,
                stamp_ns=time.time_ns(),
                progress=count,
                ready=False,
                problem=what,
                metrics={START_S: time.monotonic() - began_s},
            )
        )

    def run() -> None:
        count = 1
        while not done.wait(HEARTBEAT_S):
            count += 1
            beat(count)

    beat(1)
    thread = threading.Thread(target=run, name="long-start", daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def is_starting(beat: Heartbeat) -> bool:
    """Whether a heartbeat says that the service's start goes on."""
    return START_S in beat.metrics
