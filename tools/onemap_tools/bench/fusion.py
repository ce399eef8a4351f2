"""Time the mapper takes to fuse one frame of a simulated room with random features."""

from __future__ import annotations

import os
import resource
import time
from typing import Any

import numpy as np
import torch

from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame_update import compute_update
from onemap_shared.camera import Intrinsics, ray_directions
from onemap_shared.geometry import F32, F64, camera_mount, pose_2d
from onemap_shared.messages import FeatureField

SIZE = (480, 640)
CAMERA = Intrinsics.from_fov(SIZE[1], SIZE[0], np.deg2rad(79))  # a usual RGB-D camera
PATCHES = (24, 24, 768)
ROOM_LOW, ROOM_HIGH = (-4.0, -3.0, 0.0), (4.0, 3.0, 2.5)  # metres
WARM_UP = 5  # frames that are fused but not counted: first allocations
SEED = 0


def run(frames: int, *, device: str, threads: int) -> dict[str, Any]:
    """Fuse ``frames`` frames of a robot that walks in a circle; times in milliseconds."""
    torch.set_num_threads(threads)
    params = MapperConfig(device=device)
    rng = np.random.default_rng(SEED)
    belief = BeliefMap(params)
    observing, absorbing, computing = [], [], []
    for sequence in range(frames + WARM_UP):
        field = simulated_field(sequence, rng)
        started, cpu_started = time.perf_counter(), time.process_time()
        update = compute_update(field, params)
        observed = time.perf_counter()
        belief.fuse(update)
        _synchronise(params.torch_device)
        ended = time.perf_counter()
        computing.append((time.process_time() - cpu_started) * 1e3)
        observing.append((observed - started) * 1e3)
        absorbing.append((ended - observed) * 1e3)
    observe_ms, absorb_ms = np.array(observing[WARM_UP:]), np.array(absorbing[WARM_UP:])
    total_ms = observe_ms + absorb_ms
    return {
        "benchmark": "fusion",
        "frames": frames,
        "image": f"{SIZE[1]}x{SIZE[0]}",
        "features": "x".join(str(n) for n in PATCHES),
        "p50_ms": round(float(np.median(total_ms)), 2),
        "p95_ms": round(float(np.quantile(total_ms, 0.95)), 2),
        "min_ms": round(float(total_ms.min()), 2),
        "cpu_p50_ms": round(float(np.median(computing[WARM_UP:])), 2),
        "observe_p50_ms": round(float(np.median(observe_ms)), 2),
        "absorb_p50_ms": round(float(np.median(absorb_ms)), 2),
        "cells": belief.store.count,
        "map_bytes": belief.memory_bytes,
        "peak_process_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "device": device,
        "threads": threads,
        "cores": len(os.sched_getaffinity(0)),
        "load_average": round(os.getloadavg()[0], 2),
    }


def simulated_field(sequence: int, rng: np.random.Generator) -> FeatureField:
    """A frame in an empty room, from a camera 1 m high that looks 15 degrees down."""
    angle = 0.2 * sequence
    body = pose_2d(1.5 * np.cos(angle), 1.0 * np.sin(angle), angle + 1.0)
    T_map_camera = body @ camera_mount(0.0, 1.0, np.deg2rad(15))
    depth_m = room_depth(T_map_camera)
    features = rng.standard_normal(PATCHES, dtype=np.float32)
    features /= np.linalg.norm(features, axis=-1, keepdims=True)
    return FeatureField(
        sequence=sequence,
        stamp_ns=(sequence + 1) * 100_000_000,
        encoder_id="benchmark",
        text_space="benchmark",
        features=features.astype(np.float16),
        variance=np.exp(((1.0 - depth_m) / 1.5) ** 2 / 3),
        depth_mm=np.round(depth_m * 1000).astype(np.uint16),
        intrinsics=CAMERA,
        T_map_camera=T_map_camera,
    )


def room_depth(T_map_camera: F64) -> F32:
    """z-depth (H, W) float32 metres of the room seen from inside, without noise."""
    rays = ray_directions(CAMERA, width=SIZE[1], height=SIZE[0]) @ T_map_camera[:3, :3].T
    position = T_map_camera[:3, 3]
    wall = np.where(rays > 0, ROOM_HIGH, ROOM_LOW)
    with np.errstate(divide="ignore"):
        depth: F32 = ((wall - position) / rays).min(axis=-1).astype(np.float32)
    return depth


def _synchronise(device: torch.device) -> None:
    if device.type == "cuda":
        torch.cuda.synchronize(device)
