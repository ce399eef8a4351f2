"""Time the mapper takes to fuse one frame of a simulated room with random features."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import torch

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.camera_check import diagnosis_due
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_shared.camera import Intrinsics, ray_directions
from onemap_shared.geometry import F32, F64, camera_mount, pose_2d
from onemap_shared.messages import FeatureField
from onemap_tools.bench.machine import machine_facts, peak_process_bytes, spread_ms, wall_clock
from onemap_tools.bench.options import FusionBench

SIZE = (480, 640)
CAMERA = Intrinsics.from_fov(SIZE[1], SIZE[0], np.deg2rad(79))  # a usual RGB-D camera
PATCHES = (24, 24, 768)
ROOM_LOW, ROOM_HIGH = (-4.0, -3.0, 0.0), (4.0, 3.0, 2.5)  # metres
WARM_UP = 5  # frames that are fused but not counted: first allocations


def run(options: FusionBench, _tell: Callable[[str], None]) -> dict[str, Any]:
    """Fuse frames of a robot that walks in a circle; times in milliseconds."""
    torch.set_num_threads(options.threads)
    params = MapParams(device=options.device)
    device = params.torch_device
    belief, times = _fuse(options, params)
    observe_ms, absorb_ms, cpu_ms = (column[WARM_UP:] for column in times.T)
    return {
        "benchmark": "fusion",
        "seed": options.seed,
        "frames": options.frames,
        "image": f"{SIZE[1]}x{SIZE[0]}",
        "features": "x".join(str(n) for n in PATCHES),
        "blur_cells": 2 * params.blur_half_width_cells + 1,
        **spread_ms(observe_ms + absorb_ms),
        **spread_ms(cpu_ms, "cpu_"),
        **spread_ms(observe_ms, "observe_"),
        **spread_ms(absorb_ms, "absorb_"),
        "cells": belief.store.count,
        "map_bytes": belief.memory_bytes,
        **machine_facts(device),
        "peak_process_bytes": peak_process_bytes(),
    }


def _fuse(options: FusionBench, params: MapParams) -> tuple[BeliefMap, F64]:
    """The map, and per frame the milliseconds of its update, of fusing it, and of the processor."""
    rng, belief = np.random.default_rng(options.seed), BeliefMap(params)
    times = np.zeros((options.frames + WARM_UP, 3))
    now_s, diagnosed_ns = wall_clock(params.torch_device), None
    for sequence in range(len(times)):
        field = simulated_field(sequence, rng)
        started, cpu_started = now_s(), time.process_time()
        diagnose = diagnosis_due(field.stamp_ns, diagnosed_ns)  # as the mapper does
        update = compute_update(field, params, diagnose=diagnose)
        diagnosed_ns = field.stamp_ns if diagnose else diagnosed_ns
        observed = now_s()
        belief.fuse(update)
        ended = now_s()
        cpu = time.process_time() - cpu_started
        times[sequence] = observed - started, ended - observed, cpu
    return belief, times * 1e3


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
        colours=rng.integers(1, 256, (*PATCHES[:2], 3), np.uint8),
    )


def room_depth(T_map_camera: F64) -> F32:
    """z-depth (H, W) float32 metres of the room seen from inside, without noise."""
    rays = ray_directions(CAMERA, width=SIZE[1], height=SIZE[0]) @ T_map_camera[:3, :3].T
    position = T_map_camera[:3, 3]
    wall = np.where(rays > 0, ROOM_HIGH, ROOM_LOW)
    with np.errstate(divide="ignore"):
        depth: F32 = ((wall - position) / rays).min(axis=-1).astype(np.float32)
    return depth
