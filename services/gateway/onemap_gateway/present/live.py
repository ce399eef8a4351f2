"""What the robot is doing now: as one JSON document, and as what is drawn over the map."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from onemap.replies import DECIMALS
from onemap_gateway.bus.live_state import LiveState, newest
from onemap_gateway.present.render import Overlay
from onemap_gateway.present.replies import age_s, search_snapshot, stage_latencies
from onemap_gateway.present.service_status import (
    STREAM_TIMEOUT_S,
    PipelineFault,
    assess_services,
    ended_driver,
)
from onemap_shared.messages import RgbdFrame, SearchState

STANDS_MPS, STANDS_RADPS = 0.02, 0.05  # up to which a robot stands: the noise of odometry
PATH_ARRAYS = (
    "points_m", "goal_m", "frontiers_m", "frontier_scores", "regions_m", "region_scores",
)  # fmt: skip


def live_document(
    state: LiveState, fault: PipelineFault | None, *, now_s: float, now_ns: int, with_trail: bool
) -> dict[str, Any]:
    """The state without images, which clients fetch when their sequence numbers change."""
    search, services = newest(state.search), assess_services(state, now_s)
    return {
        "ready": fault is None,
        "problem": fault.detail if fault else "",
        "robot": _robot(state, now_s),
        "trail_m": _rounded(state.trail_m) if with_trail else None,
        "map": _map(state, now_s, now_ns),
        "camera": _camera(state, now_s),
        "path": _path(state, now_s),
        "search": search_snapshot(search).model_dump(mode="json") if search else None,
        "services": [
            {"name": r.name, "condition": r.condition, "problem": r.problem} for r in services
        ],
        "latencies": [each.model_dump() for each in stage_latencies(state.latencies)],
    }


def _robot(state: LiveState, now_s: float) -> dict[str, Any] | None:
    """Its newest pose; no speed of one that has fallen silent, of which it is open if it moves."""
    if state.odometry is None or state.robot is None:
        return None
    x_m, y_m, yaw_rad = state.robot
    numbers = {"x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad, "age_s": state.odometry.age_s(now_s)}
    rounded = {name: round(number, DECIMALS) for name, number in numbers.items()}
    newest_odometry = state.odometry.message
    gone = not state.connected or bool(ended_driver(state, now_s))
    fresh = not gone and state.odometry.age_s(now_s) <= STREAM_TIMEOUT_S
    speed_mps = round(newest_odometry.linear_mps, DECIMALS) if fresh else None
    speeds_mps = (newest_odometry.linear_mps, newest_odometry.lateral_mps)
    turns = abs(newest_odometry.angular_radps) > STANDS_RADPS
    return {
        **rounded,
        "linear_mps": speed_mps,
        "moves": not gone and (turns or max(map(abs, speeds_mps)) > STANDS_MPS),
        "collided": newest_odometry.collided,
    }


def _map(state: LiveState, now_s: float, now_ns: int) -> dict[str, Any] | None:
    if state.revision is None:
        return None
    revision = state.revision.message
    return {
        "revision": revision.revision,
        "frames_fused": revision.frames_fused,
        "cells_observed": revision.cells_observed,
        "update_ms": round(revision.update_ms, 1),
        "rate_hz": round(state.revision.rate_hz(now_s), 2),
        "age_s": age_s(revision.stamp_ns, now_ns),
        "encoder_id": revision.encoder_id,
        "objects_version": revision.objects_version,
        "places_version": revision.places_version,
    }


def _camera(state: LiveState, now_s: float) -> dict[str, Any] | None:
    if state.frame is None:
        return None
    frame = state.frame.message
    detections = state.detections_now(now_s)
    return {
        "sequence": frame.sequence,
        "width_px": frame.rgb.shape[1],
        "height_px": frame.rgb.shape[0],
        "rate_hz": round(state.frame.rate_hz(now_s), 1),
        "age_s": round(state.frame.age_s(now_s), DECIMALS),
        "view": _view(frame),
        "detections": [
            {"name": name, "score": round(float(score), 2), "box_px": _rounded(box)}
            for name, score, box in zip(
                detections.names, detections.scores, detections.boxes_px, strict=True
            )
        ]
        if detections
        else [],
    }


def _view(frame: RgbdFrame) -> dict[str, float]:
    """Where the camera was (metres) and the edges of its image from above, yaw in radians."""
    T_map_camera = frame.T_map_camera
    columns = {"left_rad": -0.5, "right_rad": frame.rgb.shape[1] - 0.5}
    view = dict(zip(("x_m", "y_m"), T_map_camera[:2, 3], strict=True))
    for name, column in columns.items():
        x, y = T_map_camera[:2, :3] @ (frame.intrinsics.x_at(column), 0.0, 1.0)
        view[name] = np.arctan2(y, x)
    return {name: round(float(value), DECIMALS) for name, value in view.items()}


def _path(state: LiveState, now_s: float) -> dict[str, Any] | None:
    path = state.path_now(now_s)
    if path is None:
        return None
    return {
        "goal_kind": path.goal_kind,
        "goal_reason": path.goal_reason,
        **{name: _rounded(getattr(path, name)) for name in PATH_ARRAYS},
    }


def _rounded(values: Any) -> Any:
    """Nested lists, rounded; null for NaN and infinity, which JSON does not have."""
    array = np.asarray(values, dtype=np.float64)
    cells = np.round(array, DECIMALS).astype(object)
    cells[~np.isfinite(array)] = None
    return cells.tolist()


def build_overlay(state: LiveState, now_s: float) -> Overlay:
    """Robot, trail, path, frontiers, regions and found objects of a state."""
    search = newest(state.search)
    overlay = Overlay(
        trail_m=np.array(state.trail_m, dtype=np.float64).reshape(-1, 2),
        robot=state.robot or (),
        found=tuple(
            (result.name, result.position_m[0], result.position_m[1])
            for result in (search.results if search else ())
            if result.outcome is SearchState.FOUND and len(result.position_m) >= 2
        ),
    )
    path = state.path_now(now_s)
    if path is None:
        return overlay
    return replace(
        overlay,
        path_m=path.points_m,
        goal_m=path.goal_m,
        frontiers_m=path.frontiers_m,
        frontier_scores=path.frontier_scores,
        regions_m=path.regions_m,
    )
