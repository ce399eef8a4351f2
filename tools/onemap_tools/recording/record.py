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
from onemap_shared.keys import Procedure, Topic
from onemap_shared.messages import (
    FeatureField,
    Heartbeat,
    MapClear,
    MapDigestRequest,
    MapRevision,
    SearchStatus,
    SearchViewRequest,
)
from onemap_shared.params import masked
from onemap_shared.transport import Bus, CallError, Subscription
from onemap_tools.errors import CliError
from onemap_tools.processes.interrupts import interruptible
from onemap_tools.processes.session import temporary_session
from onemap_tools.recording.bag_file import FRAMES, RECORDED, BagError, BagWriter

CONNECT_S = 5.0
SETTLE_S = 2.0  # for the first features; a robot that sends none may still be recorded
UPDATE_S = 0.05
LATE_S = 1.0  # for features that arrive after the revision of the map that fused them
SYNC_S = 1.0  # what a killed recorder loses at most, and how often the disk is looked at
DIGEST_S = 10.0  # the mapper computes it while it does not fuse: seldom
MEGABYTE = 10**6
COUNTED = (keys.ROBOT_RGBD, keys.ROBOT_ODOMETRY)  # their sequences have no gaps of their own

Streams = Sequence[tuple[Topic[Any], Subscription[Any]]]


@dataclass(frozen=True, slots=True)
class RecordOptions:
    """What is recorded and when it ends. ``seconds``: None records until it is stopped."""

    path: Path
    config: Path | None = None
    images: bool = True
    clear_map: bool = False
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
        if options.clear_map:
            _clear_map(bus)
        writer = BagWriter(options.path, _metadata(options.version, sections))
        recorder = BagRecorder(bus, streams, writer)
        console.print(f"Recording to {options.path}; Ctrl-C ends it.", soft_wrap=True)
        ended = _run(recorder, writer, options, stop, console)
    document = {
        "file": str(writer.path),
        "seconds": round((time.time_ns() - started_ns) / 1e9, 1),
        "bytes": writer.size,
        "messages": dict(sorted(recorder.recorded.items())),
        "missed": recorder.missed,
        "problems": recorder.problems,
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


def _clear_map(bus: Bus) -> None:
    """Clear the map once features arrive, so that none of the new map's frames is missed.

    With the second of them, the mapper has got the first: what waits there was recorded.
    """
    fields = bus.subscribe(keys.FIELD)
    if fields.take(SETTLE_S) is not None:
        fields.take(SETTLE_S)
    try:
        bus.call(keys.MAP_CLEAR, MapClear())
    except CallError as problem:
        raise CliError(f"The map was not cleared, so nothing is recorded: {problem}.") from problem


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


def _run(
    recorder: BagRecorder,
    writer: BagWriter,
    options: RecordOptions,
    stop: Event,
    console: Console,
) -> str:
    """Record until the end; returns why it ended by itself, empty if it was stopped."""
    ends_s = time.monotonic() + (options.seconds or float("inf"))
    sync_s = digest_s = time.monotonic()
    problem, warned = "", options.clear_map  # then what arrives first is the map before
    try:
        while not problem and not stop.wait(UPDATE_S) and (now_s := time.monotonic()) < ends_s:
            recorder.update(time.time_ns())
            if not warned and (warning := recorder.problems.get(keys.MAP_REVISION.key)):
                warned = True
                console.print(warning, soft_wrap=True)
            if now_s >= digest_s:
                digest_s = now_s + DIGEST_S
                recorder.snapshot(time.time_ns())
            if now_s >= sync_s:
                sync_s = now_s + SYNC_S
                writer.sync()
                problem = _disk_problem(options)
        if not problem:
            _finish(recorder)
        writer.close({"ended": problem or "stopped", "missed": json.dumps(recorder.missed)})
    except BagError as error:
        return str(error)
    return problem


def _finish(recorder: BagRecorder) -> None:
    """Record what is still on its way: a revision and its features travel apart."""
    recorder.update(time.time_ns())
    late_s = time.monotonic() + LATE_S
    while not recorder.whole and time.monotonic() < late_s:
        time.sleep(UPDATE_S)
        recorder.update(time.time_ns())
    recorder.snapshot(time.time_ns())


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
    """Call ``update`` several times a second and ``snapshot`` now and then; both raise BagError.

    problems: why services did not answer, by key; the last of each.
    """

    def __init__(self, bus: Bus, streams: Streams, writer: BagWriter) -> None:
        self._bus = bus
        self._streams = streams
        self._writer = writer
        self._target = ""
        self._fused_ns = self._field_ns = 0  # newest that a revision names, and that a field has
        self.recorded: Counter[str] = Counter()
        self.problems: dict[str, str] = {}

    def update(self, now_ns: int) -> None:
        """Write all messages since the last update."""
        for topic, subscription in self._streams:
            while (message := subscription.take(0.0)) is not None:
                beat = isinstance(message, Heartbeat)
                key = keys.heartbeat(message.service).key if beat else topic.key
                self._write(key, message, now_ns)
                match message:
                    case SearchStatus():
                        self._target = message.target
                    case MapRevision():
                        self._check_beginning(message)
                        self._fused_ns = message.stamp_ns
                    case FeatureField():
                        self._field_ns = message.stamp_ns

    def _check_beginning(self, revision: MapRevision) -> None:
        """Note that the map holds frames from before the recording, until it is cleared."""
        key = keys.MAP_REVISION.key
        if revision.frames_fused == 0:
            self.problems.pop(key, None)
        elif self.recorded[key] == 1 and revision.revision > 1:
            self.problems[key] = (
                f"The map holds {revision.frames_fused} frames from before this recording, so that "
                "'onemap replay' can compare nothing until it is cleared: begin again with "
                "--clear-map, or run 'onemap map clear'."
            )

    @property
    def whole(self) -> bool:
        """Whether the features of the newest recorded revision are recorded too."""
        return self._field_ns >= self._fused_ns

    @property
    def missed(self) -> dict[str, int]:
        """Messages that were published and not recorded, by key; only where there are any."""
        counts = {}
        for topic, subscription in self._streams:
            counters = subscription.counters
            lost = counters.missed if topic in COUNTED else counters.skipped
            counts[topic.key] = lost + counters.refused
        return {key: count for key, count in counts.items() if count}

    def snapshot(self, now_ns: int) -> None:
        """Write the map's digest and its layers, with the similarity to what is sought now."""
        self._ask(keys.MAP_DIGEST, MapDigestRequest(), now_ns)
        self._ask(keys.MAP_SEARCH_VIEW, SearchViewRequest(self._target), now_ns)

    def _ask(self, procedure: Procedure[Any, Any], request: object, now_ns: int) -> None:
        """Write a service's answer under its own key, as if it had been published."""
        try:
            self._write(procedure.key, self._bus.call(procedure, request), now_ns)
        except CallError as problem:
            self.problems[procedure.key] = str(problem)

    def _write(self, key: str, message: object, now_ns: int) -> None:
        self._writer.write(key, message, now_ns)
        self.recorded[key] += 1
