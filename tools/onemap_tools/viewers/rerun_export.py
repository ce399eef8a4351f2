"""``onemap export rerun``: a recording as a file for Rerun's viewer."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from onemap_shared.messages import Heartbeat
from onemap_tools.bag.bag_file import BagError, BagMessage, BagReader
from onemap_tools.bag.recorded_topics import FRAMES, IMAGES, OTHERS, VIEWS
from onemap_tools.errors import EXIT_FAILED, EXIT_USAGE_ERROR, CliError
from onemap_tools.viewers.rerun_entities import IMAGE, SHOWN, WORLD, entities_of

RECORDED, CAPTURED = "recorded", "captured"  # timelines: the recorder's clock, the message's own
HEALTH = Heartbeat.__name__
TYPES = {
    topic.key: topic.message
    for topic in (*(topic for topic, _ in (*IMAGES, *OTHERS)), VIEWS)
    if topic.message in SHOWN
}


def export(path: Path, out: Path) -> dict[str, Any]:
    """Write ``out``; returns counts. CliError for what cannot be read or written."""
    if out.exists():
        raise CliError(f"{out} exists: choose another name, or remove it.", EXIT_USAGE_ERROR)
    stream = rr.RecordingStream("onemap", recording_id=path.stem)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        stream.save(out, default_blueprint=blueprint())
    except (OSError, RuntimeError) as problem:
        raise CliError(f"Cannot write {out}: {problem}.", EXIT_FAILED) from problem
    reader, counts = BagReader(path), Counter[str]()
    stream.log(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    try:
        for message in reader.messages():
            counts[message.topic] += _log(stream, message)
    except BagError as problem:
        stream.disconnect()
        out.unlink()
        sentence = str(problem)
        raise CliError(f"{sentence[0].upper()}{sentence[1:]}.", EXIT_USAGE_ERROR) from problem
    finally:
        stream.flush()
        stream.disconnect()
    return {
        "file": str(out),
        "bytes": out.stat().st_size,
        "cut_off": reader.cut_off,
        "messages": {topic: count for topic, count in sorted(counts.items()) if count},
        "problems": _problems(counts),
    }


def _log(stream: rr.RecordingStream, message: BagMessage) -> int:
    """Log what a message shows; 1 if it shows anything."""
    kind = Heartbeat if message.schema.startswith(f"onemap.{HEALTH}/") else None
    kind = kind or TYPES.get(message.topic)
    if kind is None:
        return 0
    stream.set_time(RECORDED, timestamp=np.datetime64(message.log_time_ns, "ns"))
    stream.set_time(CAPTURED, timestamp=np.datetime64(message.stamp_ns, "ns"))
    for entity, archetype in entities_of(message.decode(kind)):
        stream.log(entity, archetype)
    return 1


def _problems(counts: Counter[str]) -> list[str]:
    """What the viewer will not show, each in one sentence."""
    problems = []
    if not counts[VIEWS.key]:
        problems.append("The recording holds no snapshots of the map, so that none is shown.")
    if not counts[FRAMES.key]:
        problems.append("The recording holds no images, so that none is shown.")
    return problems


def blueprint() -> rrb.Blueprint:
    """The layout with which the file opens: the map, the camera, plots and the log."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(origin=WORLD, name="Map"),
            rrb.Vertical(
                rrb.Spatial2DView(origin=IMAGE, name="Camera"),
                rrb.TimeSeriesView(origin="plots/speed", name="Speed, m/s and rad/s"),
                rrb.TimeSeriesView(origin="plots/times", name="Times, ms"),
                rrb.TextLogView(origin="log", name="Log"),
                row_shares=[3, 2, 2, 2],
            ),
            column_shares=[3, 2],
        ),
        rrb.TimePanel(timeline=RECORDED, state="collapsed"),
        collapse_panels=True,
    )


def describe(document: dict[str, Any]) -> list[str]:
    """The same for people, line by line."""
    lines = [
        f"{document['file']}: {document['bytes'] / 1e6:.1f} MB of "
        f"{sum(document['messages'].values())} messages. Open it: rerun --bind 127.0.0.1 "
        f"{document['file']}"
    ]
    if document["cut_off"]:
        lines.append("The recording was cut off; what was there is in it.")
    return [*lines, *document["problems"]]
