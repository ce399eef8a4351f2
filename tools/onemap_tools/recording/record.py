"""``onemap record``: a bag of what travels on the bus, until it is stopped or the disk is full."""

from __future__ import annotations

import hashlib
import json
import platform
import shutil
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Any

from rich.console import Console

from onemap_shared import keys
from onemap_shared.config import BusConfig, read, section
from onemap_shared.keys import Topic
from onemap_shared.messages import Heartbeat
from onemap_shared.params import masked
from onemap_shared.transport import Bus, Subscription
from onemap_tools.errors import CliError
from onemap_tools.processes.interrupts import interruptible
from onemap_tools.processes.session import temporary_session
from onemap_tools.recording.bag_file import FRAMES, RECORDED, BagError, BagWriter

CONNECT_S = 5.0
UPDATE_S = 0.05
SYNC_S = 1.0  # what a killed recorder loses at most, and how often the disk is looked at
MEGABYTE = 10**6
COUNTED = (keys.ROBOT_RGBD, keys.ROBOT_ODOMETRY)  # their sequences have no gaps of their own

Streams = Sequence[tuple[Topic[Any], Subscription[Any]]]


@dataclass(frozen=True, slots=True)
class RecordOptions:
    """What is recorded and when it ends. ``seconds``: None records until it is stopped."""

    path: Path
    config: Path | None = None
    images: bool = True
    seconds: float | None = None
    keep_free_mb: int = 1000
    version: str = ""


def record(options: RecordOptions, console: Console) -> dict[str, Any]:
    """Record; returns what was recorded. CliError with it if the recording ended by itself."""
    sections = read(options.config)
    with (
        interruptible() as stop,
        temporary_session(section(sections, "bus", BusConfig), "recorder", CONNECT_S) as bus,
    ):
        started_ns = time.time_ns()
        streams = subscribed(bus, images=options.images)
        writer = BagWriter(options.path, _metadata(options.version, sections))
        recorder = BagRecorder(streams, writer)
        console.print(f"Recording to {options.path}; Ctrl-C ends it.", soft_wrap=True)
        ended = _run(recorder, writer, options, stop)
    document = {
        "file": str(writer.path),
        "seconds": round((time.time_ns() - started_ns) / 1e9, 1),
        "bytes": writer.size,
        "messages": dict(sorted(recorder.recorded.items())),
        "missed": recorder.missed,
    }
    if ended:
        raise CliError(ended, document=document)
    return document


def subscribed(bus: Bus, *, images: bool) -> Streams:
    """What is recorded, from now on."""
    return [
        (topic, bus.subscribe(topic, capacity))
        for topic, capacity in RECORDED
        if images or topic is not FRAMES
    ]


def _metadata(version: str, sections: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """What is known at the start; secrets of the configuration are masked.

    configuration_sha256: of the configuration as recorded, to compare two recordings.
    """
    configuration = {name: json.dumps(masked(value)) for name, value in sections.items()}
    whole = json.dumps(configuration, sort_keys=True).encode()
    return {
        "onemap": {
            "version": version,
            "python": platform.python_version(),
            "machine": platform.machine(),
            "started_ns": str(time.time_ns()),
            "configuration_sha256": hashlib.sha256(whole).hexdigest(),
        },
        "configuration": configuration,
    }


def _run(recorder: BagRecorder, writer: BagWriter, options: RecordOptions, stop: Event) -> str:
    """Record until the end; returns why it ended by itself, empty if it was stopped."""
    ends_s = time.monotonic() + (options.seconds or float("inf"))
    sync_s, problem = time.monotonic(), ""
    try:
        while not problem and not stop.wait(UPDATE_S) and (now_s := time.monotonic()) < ends_s:
            recorder.update(time.time_ns())
            if now_s >= sync_s:
                sync_s = now_s + SYNC_S
                writer.sync()
                problem = _disk_problem(options)
        if not problem:
            recorder.update(time.time_ns())
        writer.close({"ended": problem or "stopped", "missed": json.dumps(recorder.missed)})
    except BagError as error:
        return str(error)
    return problem


def _disk_problem(options: RecordOptions) -> str:
    free_mb = shutil.disk_usage(options.path.parent).free / MEGABYTE
    if free_mb >= options.keep_free_mb:
        return ""
    return (
        f"The recording ended because the disk of {options.path} has only {free_mb:.0f} MB left "
        f"and --keep-free asks for {options.keep_free_mb} MB: what was recorded is complete; "
        "make room, or record to another disk."
    )


class BagRecorder:
    """Call ``update`` several times a second; it raises BagError."""

    def __init__(self, streams: Streams, writer: BagWriter) -> None:
        self._streams = streams
        self._writer = writer
        self.recorded: Counter[str] = Counter()

    def update(self, now_ns: int) -> None:
        """Write all messages since the last update."""
        for topic, subscription in self._streams:
            while (message := subscription.take(0.0)) is not None:
                beat = isinstance(message, Heartbeat)
                key = keys.heartbeat(message.service).key if beat else topic.key
                self._writer.write(key, message, now_ns)
                self.recorded[key] += 1

    @property
    def missed(self) -> dict[str, int]:
        """Messages that were published and not recorded, by key; only where there are any."""
        counts = {}
        for topic, subscription in self._streams:
            counters = subscription.counters
            lost = counters.missed if topic in COUNTED else counters.skipped
            counts[topic.key] = lost + counters.refused
        return {key: count for key, count in counts.items() if count}
