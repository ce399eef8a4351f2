"""How long the map takes to fuse one frame: ``onemap bench fusion``.

Everything the mapper does per frame is timed: projection, blur, fusion and occupancy of a
640 x 480 field with 24 x 24 x 768 features. The variance belongs to perception and the
decoding to the bus; both are made beforehand. The room is simulated, the features random.
``cpu_p50_ms`` is the processor time of a frame, which other processes disturb less.
"""

from __future__ import annotations

import json
import os
import resource
import time

import numpy as np
import torch

from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame_update import compute_update
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, camera_mount, pose_2d
from onemap_shared.messages import FeatureField
from onemap_tools.bench.parser import Parser

SIZE = (480, 640)
CAMERA = Intrinsics.from_fov(SIZE[1], SIZE[0], np.deg2rad(79))  # a usual RGB-D camera
PATCHES = (24, 24, 768)
ROOM_LOW, ROOM_HIGH = (-4.0, -3.0, 0.0), (4.0, 3.0, 2.5)  # metres
WARM_UP = 5  # frames that are fused but not counted: first allocations


def run(frames: int = 50, *, device: str = "cpu", threads: int = 1, seed: int = 0) -> dict:
    """Fuse ``frames`` frames of a robot that walks in a circle; times in milliseconds."""
    if frames < 1:
        raise ValueError(f"frames is {frames}; at least one must be fused")
    torch.set_num_threads(threads)
    params = MapperConfig(device=device)
    rng = np.random.default_rng(seed)
    belief = BeliefMap(params)
    observing, absorbing, computing = [], [], []
    for sequence in range(frames + WARM_UP):
        field = simulated_field(sequence, rng)
        started, cpu_started = time.perf_counter(), time.process_time()
        seen = compute_update(field, params)
        observed = time.perf_counter()
        belief.fuse(seen)
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
    x = (np.arange(SIZE[1]) + 0.5 - CAMERA.cx) / CAMERA.fx
    y = (np.arange(SIZE[0]) + 0.5 - CAMERA.cy) / CAMERA.fy
    rays = np.stack(np.broadcast_arrays(x[None, :], y[:, None], 1.0), axis=-1)
    rays = rays @ T_map_camera[:3, :3].T
    position = T_map_camera[:3, 3]
    wall = np.where(rays > 0, ROOM_HIGH, ROOM_LOW)
    with np.errstate(divide="ignore"):
        depth: F32 = ((wall - position) / rays).min(axis=-1).astype(np.float32)
    return depth


def _synchronise(device: torch.device) -> None:
    if device.type == "cuda":
        torch.cuda.synchronize(device)


def main(arguments: list[str] | None = None) -> int:
    """``onemap bench fusion``; returns the exit code."""
    parser = Parser(prog="onemap bench fusion", description=__doc__)
    parser.add_argument("--frames", type=int, default=50)
    parser.add_argument("--device", default="cpu", help="cpu or cuda")
    parser.add_argument("--threads", type=int, default=1, help="CPU threads of torch")
    parser.add_argument("--json", action="store_true", help="one JSON object as the last line")
    options = parser.parse_args(arguments)
    result = run(options.frames, device=options.device, threads=options.threads)
    if options.json:
        print(json.dumps(result))
        return 0
    for name, value in result.items():
        print(f"{name:20} {value}")
    return 0
