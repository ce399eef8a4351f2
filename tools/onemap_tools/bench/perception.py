"""Time that encoders take for one frame, with and without their weights."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch

from onemap_perception.config import (
    EncoderParams,
    MiniParams,
    PerceptionConfig,
    PhotoParams,
    ShippedParams,
)
from onemap_perception.encoders.images import fitted_size, pixel_values, resized
from onemap_perception.encoders.openclip_convnext import (
    CLIP_MEAN,
    CLIP_STD,
    STRIDE,
    DenseConvNext,
    named_architecture,
    read_config,
)
from onemap_perception.encoders.tipsv2 import DenseTips
from onemap_perception.encoders.torch_encoder import NO_MEAN, NO_STD, TorchEncoder, TorchTower
from onemap_perception.errors import OPEN_CLIP, TRANSFORMERS, BackendError, optional_import
from onemap_perception.factory import make_encoder
from onemap_shared.config import load
from onemap_shared.geometry import F16, F32, U8
from onemap_tools.bench.machine import machine_facts, parse_size, peak_process_bytes, spread_ms
from onemap_tools.bench.options import PerceptionBench

BACKENDS = ("mini", "photo", "openclip_convnext", "tipsv2")  # that need no download
WARM_UP = 5  # frames that are not counted: first allocations, and what cuDNN tries out


@dataclass(frozen=True, slots=True)
class MeasuredEncoder:
    """From an image to features; the tower and its input, if it is a torch module."""

    encode: Callable[[U8], F16]
    tower: TorchTower | None = None
    prepare: Callable[[U8], F32] | None = None


def run(options: PerceptionBench, _tell: Callable[[str], None]) -> dict[str, Any]:
    """Backends with random weights (mini, photo: their own), or the configured encoder."""
    if options.threads is not None:
        torch.set_num_threads(options.threads)
    size_px = parse_size(options.size)
    devices = options.device or (["cpu", "cuda"] if torch.cuda.is_available() else ["cpu"])
    makers: list[tuple[str, str, Callable[[], MeasuredEncoder]]] = []
    if options.random_weights:
        if unknown := set(options.backend or ()) - set(BACKENDS):
            raise ValueError(f"--backend is {min(unknown)!r}; there are {', '.join(BACKENDS)}")
        makers += [
            (backend, device, partial(random_encoder, backend, device, options.architecture))
            for backend in options.backend or BACKENDS
            for device in (["cpu"] if backend in ("mini", "photo") else devices)
        ]
    else:
        config = load(options.config, "perception", PerceptionConfig)[2].encoder
        device = "cpu" if isinstance(config, ShippedParams) else config.device
        makers.append((config.backend, device, partial(configured_encoder, config)))
    results = []
    for backend, device, make in makers:
        row: dict[str, Any] = {"backend": backend, "device": device}
        try:
            row |= measure(make(), size_px, options.frames, on_gpu=device.startswith("cuda"))
        except BackendError as problem:
            row["problem"] = str(problem)
        results.append(row)
    return {
        "benchmark": "perception",
        "image": options.size,
        "frames": options.frames,
        "results": results,
        **machine_facts(),
        "threads": torch.get_num_threads(),
        "gpu": torch.cuda.get_device_name() if torch.cuda.is_available() else "",
    }


def configured_encoder(config: EncoderParams) -> MeasuredEncoder:
    """The configured encoder."""
    encoder = make_encoder(config)
    if not isinstance(encoder, TorchEncoder) or not isinstance(encoder.tower, TorchTower):
        return MeasuredEncoder(encoder.encode)
    return MeasuredEncoder(encoder.encode, encoder.tower, encoder.prepare)


def random_encoder(backend: str, device: str, architecture: str) -> MeasuredEncoder:
    """A backend with random weights; raises BackendError."""
    match backend:
        case "mini":
            return configured_encoder(MiniParams())
        case "photo":
            return configured_encoder(PhotoParams())
        case "openclip_convnext":
            with optional_import("open_clip", OPEN_CLIP, backend=backend):
                from open_clip.model import CLIP

            named = not architecture.endswith(".json")
            read = named_architecture if named else lambda file: read_config(Path(file))
            config = read(architecture)
            vision = {**config["vision_cfg"], "timm_model_pretrained": False}
            # Only the image tower runs: the text tower is as small as possible.
            text = {"width": 8, "heads": 1, "layers": 1}
            module: torch.nn.Module = DenseConvNext(
                CLIP(embed_dim=config["embed_dim"], vision_cfg=vision, text_cfg=text).visual
            )
            stride, side, mean, std = STRIDE, 640, CLIP_MEAN, CLIP_STD
        case _:
            with optional_import("transformers", TRANSFORMERS, backend=backend):
                from transformers import Tipsv2Config, Tipsv2VisionModel

            module = DenseTips(Tipsv2VisionModel(Tipsv2Config().vision_config))
            stride, side, mean, std = 14, 448, NO_MEAN, NO_STD
    tower = TorchTower(module.requires_grad_(False), device)

    def prepare(rgb: U8) -> F32:
        size = fitted_size(rgb.shape[1], rgb.shape[0], long_side_px=side, stride=stride)
        return pixel_values(resized(rgb, size), mean, std)

    return MeasuredEncoder(lambda rgb: tower(prepare(rgb)), tower, prepare)


def noise(width: int, height: int) -> U8:
    """An image (H, W, 3) of squares as large as a patch of ``mini``, in colours of chance.

    Nothing that ``mini`` is sure of, as it is of finer noise: there ``photo`` asks no classifier.
    """
    side = max(width // 40, 1)
    shape = (height // side + 1, width // side + 1, 3)
    squares = np.random.default_rng(0).integers(0, 256, shape).astype(np.uint8)
    return squares.repeat(side, 0).repeat(side, 1)[:height, :width]


def measure(
    encoder: MeasuredEncoder, size_px: tuple[int, int], frames: int, *, on_gpu: bool
) -> dict[str, Any]:
    """Milliseconds per frame, frames per second, memory."""
    width, height = size_px
    rgb = noise(width, height)
    if on_gpu:
        torch.cuda.reset_peak_memory_stats()
    features = encoder.encode(rgb)
    times_ms = []
    for index in range(frames + WARM_UP):
        frame = rgb.copy()  # another array, as from a camera: photo keeps what it saw in the last
        begun = time.perf_counter()
        encoder.encode(frame)
        if index >= WARM_UP:
            times_ms.append((time.perf_counter() - begun) * 1e3)
    result = {
        "features": "x".join(str(side) for side in features.shape),
        **spread_ms(times_ms, "frame_"),
        "frames_per_s": round(1e3 / float(np.median(times_ms)), 2),
    }
    if on_gpu and encoder.tower is not None and encoder.prepare is not None:
        events_ms = _device_ms(encoder.tower, encoder.prepare(rgb), frames)
        result |= spread_ms(events_ms, "network_")
        result["peak_device_bytes"] = torch.cuda.max_memory_allocated()
    return result | {"peak_process_bytes": peak_process_bytes()}


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
