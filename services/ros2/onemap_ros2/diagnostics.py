"""``/diagnostics``: the robot's topics, OneMap's services and the search, for ROS 2's own tools."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from onemap_ros2.cdr import DIAGNOSTICS, NS, encode, header, new
from onemap_ros2.topic_watch import SILENT_S, TopicWatch
from onemap_shared.messages import Heartbeat, SearchState, SearchStatus
from onemap_shared.transport import Health

OK, WARN, ERROR, STALE = range(4)  # of diagnostic_msgs/DiagnosticStatus


class Diagnosis(NamedTuple):
    """The state of one part, of level OK, WARN, ERROR or STALE, with numbers for programs."""

    name: str
    level: int
    message: str
    values: Mapping[str, object] = {}


def of_adapter(health: Health) -> Diagnosis:
    """The adapter itself: ERROR while the robot cannot be used."""
    level = ERROR if not health.ready else WARN if health.problem else OK
    return Diagnosis("ros2", level, health.problem or "ready", health.metrics or {})


def of_topic(watch: TopicWatch, now_s: float) -> Diagnosis:
    """A topic of the robot: STALE after ``SILENT_S`` without a message."""
    silence, rate = watch.silence(now_s), f"{watch.rate_hz:.1f}"
    values: dict[str, object] = {
        "messages": watch.messages,
        "rate_hz": rate,
        "silent_s": f"{watch.silent_s(now_s):.1f}",
    }
    if watch.stamp_ns is not None:
        values["last_stamp_s"] = f"{watch.stamp_ns / NS:.3f}"
    level = STALE if silence else OK
    return Diagnosis(f"topic {watch.topic}", level, silence or f"{rate} Hz", values)


def of_service(beat: Heartbeat, silent_s: float) -> Diagnosis:
    """A service of OneMap by its newest heartbeat; one a second is due."""
    if silent_s > SILENT_S:
        return Diagnosis(beat.service, STALE, f"no heartbeat for {silent_s:.0f} s")
    level = ERROR if not beat.ready else WARN if beat.problem else OK
    return Diagnosis(beat.service, level, beat.problem or "ready", beat.metrics)


def of_search(status: SearchStatus | None) -> Diagnosis:
    """The newest search: WARN if it failed."""
    if status is None:
        return Diagnosis("search", OK, "none yet")
    level = WARN if status.state is SearchState.FAILED else OK
    values = {"state": status.state, "object": status.target, "id": status.search_id}
    return Diagnosis("search", level, f"{status.state}: {status.reason}", values)


def diagnostic_array(parts: Iterable[Diagnosis], stamp_ns: int) -> bytes:
    """The parts as ``diagnostic_msgs/DiagnosticArray``, named ``onemap: <part>``."""
    listed = []
    for part in parts:
        pairs = ((key, _text(value)) for key, value in part.values.items())
        values = [new("diagnostic_msgs/msg/KeyValue", *pair) for pair in pairs]
        texts = f"onemap: {part.name}", part.message, "onemap"
        listed.append(new("diagnostic_msgs/msg/DiagnosticStatus", part.level, *texts, values))
    return encode(new(DIAGNOSTICS, header(stamp_ns, ""), listed), DIAGNOSTICS)


def _text(value: object) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)
