"""``onemap record``: a bag of what travels on the bus, until it is stopped or the disk is full."""

from __future__ import annotations

import hashlib
import json
import platform
import shutil
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Any

from rich.console import Console

from onemap_shared import keys
from onemap_shared.config import BusConfig, read, section
from onemap_shared.messages import MapClear
from onemap_shared.params import masked
from onemap_shared.transport import Bus, CallError
from onemap_tools.bag.bag_file import BagError, BagWriter
from onemap_tools.bag.recorder import BagRecorder, subscribed
from onemap_tools.errors import CliError
from onemap_tools.processes.interrupts import interruptible
from onemap_tools.processes.session import temporary_session

CONNECT_S = 5.0
SETTLE_S = 2.0  # for the first features; a robot that sends none may still be recorded
UPDATE_S = 0.05
LATE_S = 1.0  # for features that arrive after the revision of the map that fused them
SYNC_S = 1.0  # what a killed recorder loses at most, and how often the disk is looked at
DIGEST_S = 10.0  # the mapper computes it while it does not fuse: seldom
MEGABYTE = 10**6


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
    """Record; returns the summary. CliError with it if the recording ended by itself."""
    sections = read(options.config)
    with (
        interruptible() as stop,
        temporary_session(section(sections, "bus", BusConfig), "recorder", CONNECT_S) as bus,
    ):
        started_ns = time.time_ns()
        streams = subscribed(bus, images=options.images)
        if options.clear_map:
            _clear_map(bus)
        try:
            writer = BagWriter(options.path, _metadata(options.version, sections))
        except BagError as problem:
            raise CliError(f"The recording did not start: {problem}.") from problem
        recorder = BagRecorder(bus, streams, writer)
        console.print(f"Recording to {options.path}; Ctrl-C ends it.", soft_wrap=True)
        ended = _run(recorder, writer, options, stop)
    document = summary(recorder, writer, (time.time_ns() - started_ns) / 1e9)
    if ended:
        raise CliError(ended, document=document)
    return document


def _run(recorder: BagRecorder, writer: BagWriter, options: RecordOptions, stop: Event) -> str:
    """Record until the end; returns why it ended by itself, empty if it was stopped."""
    ends_s = time.monotonic() + (options.seconds or float("inf"))
    sync_s = digest_s = time.monotonic()
    try:
        while not stop.wait(UPDATE_S) and (now_s := time.monotonic()) < ends_s:
            recorder.update(time.time_ns())
            if now_s >= digest_s:
                digest_s = now_s + DIGEST_S
                recorder.digest(time.time_ns())
                recorder.snapshot(time.time_ns())
            if now_s >= sync_s:
                sync_s = now_s + SYNC_S
                writer.sync()
                if problem := _disk_problem(options):
                    writer.close({"ended": problem, "missed": json.dumps(recorder.missed)})
                    return problem
        _finish(recorder)
        writer.close({"ended": "stopped", "missed": json.dumps(recorder.missed)})
    except BagError as problem:
        sentence = str(problem)
        return f"{sentence[0].upper()}{sentence[1:]}."
    return ""


def _finish(recorder: BagRecorder) -> None:
    """Record what is still on its way: a revision and its features travel apart."""
    recorder.update(time.time_ns())
    late_s = time.monotonic() + LATE_S
    while not recorder.whole and time.monotonic() < late_s:
        time.sleep(UPDATE_S)
        recorder.update(time.time_ns())
    recorder.digest(time.time_ns())
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


def summary(recorder: BagRecorder, writer: BagWriter, seconds: float) -> dict[str, Any]:
    """What was recorded, as one JSON object."""
    return {
        "file": str(writer.path),
        "seconds": round(seconds, 1),
        "bytes": writer.size,
        "messages": dict(sorted(recorder.recorded.items())),
        "missed": recorder.missed,
        "problems": recorder.problems,
    }
