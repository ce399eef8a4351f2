"""Time that encoders take for one frame of noise, with and without their weights."""

from __future__ import annotations

import contextlib
import gc
import os
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch

from onemap_perception.encoders.images import fitted_size, pixel_values, resized
from onemap_perception.encoders.mini import MiniParams
from onemap_perception.encoders.openclip_convnext import (
    CLIP_MEAN,
    CLIP_STD,
    STRIDE,
    DenseConvNext,
    named_architecture,
    read_config,
)
from onemap_perception.encoders.params import EncoderParams
from onemap_perception.encoders.tipsv2 import DenseTips
from onemap_perception.encoders.torch_encoder import NO_MEAN, NO_STD, TorchEncoder, TorchTower
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_perception.optional_import import OPEN_CLIP, TRANSFORMERS, optional_import
from onemap_shared.geometry import F16, F32, U8

WARM_UP = 5  # frames that are not counted: first allocations, and what cuDNN tries out


@dataclass(frozen=True, slots=True)
class MeasuredEncoder:
    """From an image to features; the tower and its input, if it is a torch module."""

    encode: Callable[[U8], F16]
    tower: TorchTower | None = None
    prepare: Callable[[U8], F32] | None = None


@dataclass(frozen=True, slots=True)
class PerceptionBenchParams:
    """What to measure.

    frames: per backend and device; size_px: width and height of the camera's image; architecture:
    of openclip_convnext with random weights.
    """

    frames: int
    size_px: tuple[int, int]
    architecture: str
    devices: tuple[str, ...]


def run(backends: tuple[str, ...], params: PerceptionBenchParams) -> dict[str, Any]:
    """Measure each backend on each device, with random weights (mini: with its own)."""
    results = []
    for backend in backends:
        devices = ("cpu",) if backend == "mini" else params.devices
        for device in devices:
            make = partial(random_encoder, backend, device, params)
            results.append(_measure_one(backend, device, make, params))
    return _document(results, params)


def run_configured(config: EncoderParams, params: PerceptionBenchParams) -> dict[str, Any]:
    """The encoder of a configuration, with its weights, on its device."""
    device = "cpu" if isinstance(config, MiniParams) else config.device
    return _document(
        [_measure_one(config.backend, device, partial(configured_encoder, config), params)], params
    )


def configured_encoder(config: EncoderParams) -> MeasuredEncoder:
    """The configured encoder."""
    encoder = make_encoder(config)
    if not isinstance(encoder, TorchEncoder) or not isinstance(encoder.tower, TorchTower):
        return MeasuredEncoder(encoder.encode)
    return MeasuredEncoder(encoder.encode, encoder.tower, encoder.prepare)


def random_encoder(backend: str, device: str, params: PerceptionBenchParams) -> MeasuredEncoder:
    """A backend with random weights; raises BackendError."""
    match backend:
        case "mini":
            return configured_encoder(MiniParams())
        case "openclip_convnext":
            with optional_import("open_clip", OPEN_CLIP, backend=backend, kind=BackendError):
                from open_clip.model import CLIP

            named = not params.architecture.endswith(".json")
            read = named_architecture if named else lambda file: read_config(Path(file))
            config = read(params.architecture)
            vision = {**config["vision_cfg"], "timm_model_pretrained": False}
            # Only the image tower runs: the text tower is as small as possible.
            text = {"width": 8, "heads": 1, "layers": 1}
            module: torch.nn.Module = DenseConvNext(
                CLIP(embed_dim=config["embed_dim"], vision_cfg=vision, text_cfg=text).visual
            )
            stride, side, mean, std = STRIDE, 640, CLIP_MEAN, CLIP_STD
        case _:
            with optional_import("transformers", TRANSFORMERS, backend=backend, kind=BackendError):
                from transformers import Tipsv2Config, Tipsv2VisionModel

            module = DenseTips(Tipsv2VisionModel(Tipsv2Config().vision_config))
            stride, side, mean, std = 14, 448, NO_MEAN, NO_STD
    tower = TorchTower(module.requires_grad_(False), device)

    def prepare(rgb: U8) -> F32:
        size = fitted_size(rgb.shape[1], rgb.shape[0], long_side_px=side, stride=stride)
        return pixel_values(resized(rgb, size), mean, std)

    return MeasuredEncoder(lambda rgb: tower(prepare(rgb)), tower, prepare)


def _measure_one(
    backend: str, device: str, make: Callable[[], MeasuredEncoder], params: PerceptionBenchParams
) -> dict[str, Any]:
    """The entry of one backend on one device; ``problem`` says why there are no numbers."""
    entry: dict[str, Any] = {"backend": backend, "device": device}
    _reset_peak_memory()
    try:
        return {**entry, **measure(make(), params, on_gpu=device.startswith("cuda"))}
    except BackendError as problem:
        return {**entry, "problem": str(problem)}


def measure(
    encoder: MeasuredEncoder, params: PerceptionBenchParams, *, on_gpu: bool
) -> dict[str, Any]:
    """Milliseconds per frame, frames per second, memory."""
    width, height = params.size_px
    noise = np.random.default_rng(0).integers(0, 256, (height, width, 3))
    rgb: U8 = noise.astype(np.uint8)
    if on_gpu:
        torch.cuda.reset_peak_memory_stats()
    features = encoder.encode(rgb)
    times_ms = []
    for index in range(params.frames + WARM_UP):
        begun = time.perf_counter()
        encoder.encode(rgb)
        if index >= WARM_UP:
            times_ms.append((time.perf_counter() - begun) * 1e3)
    result = {
        "features": "x".join(str(side) for side in features.shape),
        **_quantiles("frame", times_ms),
        "frames_per_s": round(1e3 / float(np.median(times_ms)), 2),
    }
    if on_gpu and encoder.tower is not None and encoder.prepare is not None:
        events_ms = _device_ms(encoder.tower, encoder.prepare(rgb), params.frames)
        result |= {
            **_quantiles("network", events_ms),
            "peak_device_bytes": torch.cuda.max_memory_allocated(),
        }
    return result | {"peak_process_bytes": _peak_memory_bytes()}


def _device_ms(tower: TorchTower, picture: F32, frames: int) -> list[float]:
    """The network alone, its input on the device already, by device events."""
    placed = torch.from_numpy(picture).to(tower.device, tower.dtype)
    pairs = []
    event: Any = torch.cuda.Event
    with torch.inference_mode():
        for _ in range(frames + WARM_UP):
            begin, end = (event(enable_timing=True) for _ in range(2))
            begin.record()
            tower.dense(placed)
            end.record()
            pairs.append((begin, end))
        torch.cuda.synchronize(tower.device)
    return [begin.elapsed_time(end) for begin, end in pairs[WARM_UP:]]


def _reset_peak_memory() -> None:
    """Reset the process's peak memory, so that each backend is measured alone."""
    gc.collect()
    with contextlib.suppress(OSError):  # not Linux: the peak stays that of the whole process
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def _peak_memory_bytes() -> int:
    """Most resident memory since the last ``_reset_peak_memory``."""
    with contextlib.suppress(OSError):
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
        for line in status.splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def _quantiles(name: str, times_ms: list[float]) -> dict[str, float]:
    return {
        f"{name}_p50_ms": round(float(np.median(times_ms)), 3),
        f"{name}_p95_ms": round(float(np.quantile(times_ms, 0.95)), 3),
    }


def _document(results: list[dict[str, Any]], params: PerceptionBenchParams) -> dict[str, Any]:
    gpu = torch.cuda.get_device_name() if torch.cuda.is_available() else ""
    return {
        "benchmark": "perception",
        "image": f"{params.size_px[0]}x{params.size_px[1]}",
        "frames": params.frames,
        "results": results,
        "threads": torch.get_num_threads(),
        "cores": len(os.sched_getaffinity(0)),
        "load_average": round(os.getloadavg()[0], 2),
        "gpu": gpu,
    }


def parse_size(text: str) -> tuple[int, int]:
    """Width and height of ``640x480``; raises ValueError."""
    width, _, height = text.partition("x")
    if not (width.isdigit() and height.isdigit() and int(width) and int(height)):
        raise ValueError(f"size is {text!r}; write it like 640x480")
    return int(width), int(height)


def available_devices() -> tuple[str, ...]:
    """The devices that this machine has."""
    return ("cpu", "cuda") if torch.cuda.is_available() else ("cpu",)
