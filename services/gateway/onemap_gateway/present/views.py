"""Converts messages of the bus to the replies and overlays that clients get."""
# Touches files: an archive in memory.

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import replace
from math import isfinite

import numpy as np

from onemap_gateway.bus.live_state import FrameLatencies, LatestMessage, LiveState
from onemap_gateway.present.choices import choice_report
from onemap_gateway.present.endings import coverage_report, evidence_report
from onemap_gateway.present.formats import DECIMALS, millimetres, rfc3339
from onemap_gateway.present.render import Overlay, on_grid
from onemap_gateway.present.replies import (
    LatencyReport,
    MapChange,
    MapInfo,
    MapListReply,
    ObjectReport,
    SavedMapReport,
    SearchListReply,
    SearchReport,
    ServiceReport,
    StatusReport,
    StreamReport,
)
from onemap_gateway.present.service_status import PipelineFault, assess_services
from onemap_shared.geometry import yaw_of
from onemap_shared.messages import (
    Layer,
    MapList,
    MapRevision,
    MapSummary,
    ObjectResult,
    Occupancy,
    SavedMap,
    SearchList,
    SearchState,
    SearchStatus,
    SearchView,
    SimilarityReply,
)
from onemap_shared.transport import Counters


def finite(value: float) -> float | None:
    """The number; None for NaN and infinity, which JSON cannot hold."""
    return float(value) if isfinite(value) else None


def age_s(stamp_ns: int, now_ns: int) -> float | None:
    """Seconds since a capture stamp; None for 0, which stands for none."""
    return max(now_ns - stamp_ns, 0) / 1e9 if stamp_ns else None


def search_report(status: SearchStatus, now_ns: int) -> SearchReport:
    """The state of a search; ``elapsed_s`` stops at its end."""
    end_ns = now_ns if status.active else status.updated_ns
    return SearchReport(
        id=status.search_id,
        kind=status.kind,
        place_m=millimetres(status.place_m) or None,
        state=status.state,
        active=status.active,
        objects=status.objects,
        index=status.index,
        target=status.target,
        reason=status.reason,
        reason_code=status.reason_code or None,
        order=status.order,
        results=[_object_report(result) for result in in_order_of_request(status)],
        choice=choice_report(status.choice),
        elapsed_s=max(end_ns - status.started_ns, 0) / 1e9,
        path_length_m=round(status.path_length_m, DECIMALS),
        started_at=rfc3339(status.started_ns),
        updated_at=rfc3339(status.updated_ns),
        started_ns=str(status.started_ns),
        updated_ns=str(status.updated_ns),
    )


def in_order_of_request(status: SearchStatus) -> list[ObjectResult]:
    """The results in the order of the objects; that of a place has no object."""
    order = {name: index for index, name in reversed(list(enumerate(status.objects)))}
    return sorted(status.results, key=lambda result: order.get(result.name, 0))


def search_list(listed: SearchList, now_ns: int) -> SearchListReply:
    """The remembered searches, newest first."""
    reports = [search_report(status, now_ns) for status in listed.searches]
    return SearchListReply(searches=reports, left_out=listed.left_out)


def _object_report(result: ObjectResult) -> ObjectReport:
    return ObjectReport(
        name=result.name,
        outcome=result.outcome,
        reason=result.reason,
        position_m=millimetres(result.position_m) or None,
        score=result.score,
        duration_s=result.duration_s,
        path_length_m=round(result.path_length_m, DECIMALS),
        start_xy_m=millimetres(result.start_xy_m) or None,
        end_xy_m=millimetres(result.end_xy_m) or None,
        reason_code=result.reason_code or None,
        coverage=coverage_report(result),
        evidence=evidence_report(result),
    )


def map_change(summary: MapSummary) -> MapChange:
    """The reply to save, load and clear."""
    return MapChange(**{name: getattr(summary, name) for name in MapChange.model_fields})


def saved_map_report(saved: SavedMap) -> SavedMapReport:
    """What is known of a saved map."""
    values = {
        name: getattr(saved, name) for name in SavedMapReport.model_fields if name[:6] != "saved_"
    }
    return SavedMapReport(**values, saved_at=rfc3339(saved.saved_ns), saved_ns=str(saved.saved_ns))


def map_list(listed: MapList) -> MapListReply:
    """The saved maps, newest first."""
    maps = [saved_map_report(saved) for saved in listed.maps]
    return MapListReply(maps=maps, left_out=listed.left_out)


def map_info(view: SearchView, revision: MapRevision | None, now_ns: int) -> MapInfo:
    """The map in numbers; ``revision`` holds those that the view lacks."""
    cell_m2 = view.grid.cell_size_m**2
    return MapInfo(
        revision=view.revision,
        age_s=age_s(view.stamp_ns, now_ns),
        bounds_m=millimetres(view.grid.bounds_m),
        cell_size_m=view.grid.cell_size_m,
        free_m2=float((view.occupancy == Occupancy.FREE).sum() * cell_m2),
        occupied_m2=float((view.occupancy == Occupancy.OCCUPIED).sum() * cell_m2),
        observed_m2=float(((view.layers & Layer.OBSERVED) != 0).sum() * cell_m2),
        frames_fused=revision.frames_fused if revision else 0,
        memory_bytes=revision.memory_bytes if revision else 0,
        update_ms=revision.update_ms if revision else 0.0,
        rate_hz=revision.rate_hz if revision else 0.0,
        encoder_id=revision.encoder_id if revision else "",
        text_space=revision.text_space if revision else "",
    )


def with_scores(view: SearchView, reply: SimilarityReply) -> SearchView:
    """The view with the scores of a reply with a grid, which may be of another revision."""
    similarity = on_grid(reply.scores_grid, reply.grid, view.grid, np.nan)
    return replace(view, text=reply.text, similarity=similarity)


def map_archive(view: SearchView) -> bytes:
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


def build_overlay(state: LiveState, now_s: float) -> Overlay:
    """Robot, trail, path, frontiers, regions and found objects of a state."""
    path = state.path_now(now_s)
    robot: tuple[float, ...] = ()
    if state.odometry:
        T_map_body = state.odometry.message.T_map_body
        robot = (float(T_map_body[0, 3]), float(T_map_body[1, 3]), yaw_of(T_map_body))
    trail_m = np.array(state.trail_m, dtype=np.float64).reshape(-1, 2)
    found = found_objects(state.search.message) if state.search else ()
    if path is None:
        return Overlay(trail_m=trail_m, robot=robot, found=found)
    return Overlay(
        trail_m=trail_m,
        path_m=path.points_m,
        goal_m=path.goal_m,
        frontiers_m=path.frontiers_m,
        frontier_scores=path.frontier_scores,
        regions_m=path.regions_m,
        robot=robot,
        found=found,
    )


def found_objects(status: SearchStatus) -> tuple[tuple[str, float, float], ...]:
    """Name, x and y of every object that was found."""
    return tuple(
        (result.name, result.position_m[0], result.position_m[1])
        for result in status.results
        if result.outcome is SearchState.FOUND and len(result.position_m) >= 2
    )


def status_report(
    state: LiveState, counters: Mapping[str, Counters], fault: PipelineFault | None, now_s: float
) -> StatusReport:
    """Every service and stream, as /v1/status returns them."""
    streams: dict[str, LatestMessage | None] = {
        "rgbd": state.frame,
        "odometry": state.odometry,
        "detections": state.detections,
        "revision": state.revision,
        "search": state.search,
        "path": state.path,
    }
    return StatusReport(
        ready=fault is None,
        problem=fault.detail if fault else "",
        services=[
            ServiceReport(
                name=report.name,
                condition=str(report.condition),
                problem=report.problem,
                alive=report.alive,
                ready=report.ready,
                heartbeat_age_s=report.heartbeat_age_s,
                metrics={name: finite(value) for name, value in report.metrics.items()},
            )
            for report in assess_services(state, now_s)
        ],
        streams=[
            StreamReport(
                name=name,
                age_s=seen.age_s(now_s) if seen else None,
                rate_hz=seen.rate_hz(now_s) if seen else 0.0,
                received=counters[name].received,
                missed=counters[name].missed,
                skipped=counters[name].skipped,
                refused=counters[name].refused,
                last_problem=counters[name].last_problem,
            )
            for name, seen in streams.items()
        ],
        latencies=latency_reports(state.latencies),
    )


def latency_reports(latencies: FrameLatencies) -> list[LatencyReport]:
    """Median and 95th percentile of every stage that was timed."""
    return [
        LatencyReport(
            stage=stage,
            p50_s=round(timed.quantile_s(0.5), DECIMALS),
            p95_s=round(timed.quantile_s(0.95), DECIMALS),
            count=sum(timed.counts),
        )
        for stage, timed in sorted(latencies.stages.items())
    ]
