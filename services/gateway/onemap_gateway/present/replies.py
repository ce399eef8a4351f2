"""Messages of the bus as the replies that clients get (``onemap.replies``)."""
# Touches files: an archive in memory.

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import dist, inf
from operator import attrgetter
from typing import Any, TypeVar

import numpy as np

from onemap import replies
from onemap.search_replies import ObjectOutcome, ReplayStep, SearchReplay, SearchSnapshot
from onemap_gateway.bus.live_state import FrameLatencies, LatestMessage, LiveState
from onemap_gateway.present.service_status import PipelineFault, assess_services
from onemap_shared import messages as m
from onemap_shared.names import same_name
from onemap_shared.sentence import Sentence, in_words
from onemap_shared.transport import Counters

R = TypeVar("R", bound=replies.Reply)


def reply_of(model: type[R], message: object, /, **more: Any) -> R:
    """The reply with the members of ``message`` that have its names, and ``more``."""
    names = [name for name in model.model_fields if name not in more and hasattr(message, name)]
    return model.model_validate({**{name: getattr(message, name) for name in names}, **more})


def age_s(stamp_ns: int, now_ns: int) -> float | None:
    """Seconds since a capture stamp; None for 0, which stands for none."""
    return max(now_ns - stamp_ns, 0) / 1e9 if stamp_ns else None


def search_snapshot(status: m.SearchStatus, finds: Sequence[m.KeptObject] = ()) -> SearchSnapshot:
    """The state of a search, with its results in the order of the request.

    finds: what the mapper keeps, which says where each is in words.
    """
    results = sorted(status.results, key=attrgetter("index"))
    details = status.details or (m.NO_DETAIL,) * len(status.objects)
    sentences = list(map(Sentence, status.objects, details))
    if sentences:
        sentences[-1] = replace(sentences[-1], stay_out=status.stay_out)
    return reply_of(
        SearchSnapshot,
        status,
        id=status.search_id,
        requests=tuple(map(str, sentences)),
        understood=in_words(sentences),
        left=_left(status, sentences),
        results=tuple(_object_outcome(each, find_of(each, finds)) for each in results),
        choice=status.choice if status.choice.options else None,
    )


def _left(status: m.SearchStatus, sentences: Sequence[Sentence]) -> tuple[str, ...]:
    """What was not found, as sentences; the robot stays out of the same places."""
    left = [replace(sentences[index], stay_out=()) for index in status.left]
    if left:
        left[-1] = replace(left[-1], stay_out=status.stay_out)
    return tuple(map(str, left))


def search_replay(record: m.SearchRecord) -> SearchReplay:
    """What was recorded of a search."""
    return SearchReplay(
        search=search_snapshot(record.status),
        steps=tuple(ReplayStep.model_validate(step) for step in record.steps),
        left_out=record.left_out,
        path_m=tuple(map(tuple, record.places.tolist())),
    )


SAME_OBJECT_M = 1.0  # as the mapper takes two finds of a name for one object


def find_of(result: m.ObjectResult, finds: Sequence[m.KeptObject]) -> m.KeptObject | None:
    """What the mapper keeps of the object that was found; None: nothing, or nothing was found."""
    if result.outcome is not m.SearchState.FOUND or not result.position_m:
        return None
    near = [
        (dist(each.position_m[:2], result.position_m[:2]), index)
        for index, each in enumerate(finds)
        if same_name(each.name, result.name)
    ]
    away_m, index = min(near, default=(inf, 0))
    return finds[index] if away_m <= SAME_OBJECT_M else None


def _object_outcome(result: m.ObjectResult, kept: m.KeptObject | None) -> ObjectOutcome:
    """Coverage belongs to what was not found, evidence to what was."""
    absent = result.outcome is m.SearchState.NOT_FOUND
    found = result.outcome in (m.SearchState.FOUND, m.SearchState.FOUND_OTHER)
    return reply_of(
        ObjectOutcome,
        result,
        coverage=result.coverage if absent else None,
        evidence=result if found else None,
        where=kept.where if kept else "",
    )


def map_statistics(
    view: m.SearchView, revision: m.MapRevision | None, now_ns: int
) -> replies.MapStatistics:
    """The map in numbers; ``revision`` holds those that the view lacks."""
    cell_m2 = view.grid.cell_size_m**2
    return reply_of(
        replies.MapStatistics,
        revision,
        revision=view.revision,
        age_s=age_s(view.stamp_ns, now_ns),
        bounds_m=view.grid.bounds_m,
        cell_size_m=view.grid.cell_size_m,
        free_m2=float((view.occupancy == m.Occupancy.FREE).sum() * cell_m2),
        occupied_m2=float((view.occupancy == m.Occupancy.OCCUPIED).sum() * cell_m2),
        observed_m2=float(((view.layers & m.Layer.OBSERVED) != 0).sum() * cell_m2),
    )


def map_archive(view: m.SearchView) -> bytes:
    """The map as ``numpy.savez`` writes it; names and meanings are those of ``GET /v1/map.npz``."""
    buffer = io.BytesIO()
    x_min, y_min, _, _ = view.grid.bounds_m
    np.savez_compressed(
        buffer,
        occupancy=view.occupancy,
        layers=view.layers,
        similarity=view.similarity,
        origin_m=np.array([x_min, y_min]),
        cell_size_m=np.array(view.grid.cell_size_m),
        revision=np.array(view.revision),
        stamp_ns=np.array(view.stamp_ns),
        text=np.array(view.text),
    )
    return buffer.getvalue()


def map_object(stored: m.KeptObject) -> replies.MapObject:
    """A kept object; its box is rounded to a tenth of a pixel."""
    return reply_of(
        replies.MapObject,
        stored,
        id=stored.object_id,
        box_px=tuple(round(side, 1) for side in stored.box_px),
        picture=f"/v1/objects/{stored.object_id}.jpg" if stored.picture_bytes else None,
    )


def system_status(
    state: LiveState, counters: Mapping[str, Counters], fault: PipelineFault | None, now_s: float
) -> replies.SystemStatus:
    """Every service and stream, as /v1/status returns them."""
    streams: dict[str, LatestMessage | None] = {
        "rgbd": state.frame,
        "odometry": state.odometry,
        "detections": state.detections,
        "revision": state.revision,
        "search": state.search,
        "path": state.path,
    }
    return replies.SystemStatus(
        ready=fault is None,
        problem=fault.detail if fault else "",
        services=tuple(assess_services(state, now_s)),
        streams=tuple(
            reply_of(
                replies.StreamHealth,
                counters[name],
                name=name,
                age_s=seen.age_s(now_s) if seen else None,
                rate_hz=seen.rate_hz(now_s) if seen else 0.0,
            )
            for name, seen in streams.items()
        ),
        latencies=stage_latencies(state.latencies),
    )


def stage_latencies(latencies: FrameLatencies) -> tuple[replies.StageLatency, ...]:
    """Median and 95th percentile of every stage that was timed."""
    return tuple(
        replies.StageLatency(
            stage=stage,
            p50_s=timed.quantile_s(0.5),
            p95_s=timed.quantile_s(0.95),
            count=sum(timed.counts),
        )
        for stage, timed in sorted(latencies.stages.items())
    )
