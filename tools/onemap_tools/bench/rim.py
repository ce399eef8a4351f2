"""The blur at the rim of what a frame shows: normalised by the whole window, or by what was seen.

The authors divide by the sum of the whole window of the Gaussian, so that a cell beside unobserved
ones gets a shorter feature and less confidence. Beside that stand the ways to divide by the sum of
the observed part only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from onemap_mapper.belief.cells import CellStore
from onemap_mapper.frame.blur import BlurKernel, blur_kernel, blurred
from onemap_mapper.frame.projection import cell_features
from onemap_mapper.frame.update import images_of
from onemap_mapper.params import MapParams
from onemap_perception.variance import VarianceParams, observation_variance
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64
from onemap_shared.messages import FeatureField
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import TRAINING
from onemap_simulator.rendering.label_renderer import LabelRenderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, measured_mm
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.exploration_tour import exploration_poses

CHANNELS = 64
PATCH_PX = 8
SIZE = (120, 160)  # rows and columns of the images
FEW = 3  # views of a cell up to which it counts as seen little
CPU = torch.device("cpu")

Blurred = tuple[Tensor, Tensor]  # features (n, D) and confidences (n,) of a kernel's cells
Way = Callable[[BlurKernel, Tensor, Tensor], Blurred]


@dataclass(frozen=True, slots=True)
class RimBenchParams:
    """The apartments, and how many images of the drive the blurred maps are made of: every n-th,
    the unblurred map being made of all."""

    seeds: tuple[int, ...]
    every: int = 4


def whole(kernel: BlurKernel, features: Tensor, confidence: Tensor) -> Blurred:
    """As the authors: both by the whole window."""
    return blurred(kernel, features), blurred(kernel, confidence)


def features_renormalised(kernel: BlurKernel, features: Tensor, confidence: Tensor) -> Blurred:
    """Features by the observed part of the window, confidence by the whole."""
    return blurred(kernel, features) / _mass(kernel)[:, None], blurred(kernel, confidence)


def both_renormalised(kernel: BlurKernel, features: Tensor, confidence: Tensor) -> Blurred:
    """Both by the observed part of the window."""
    mass = _mass(kernel)
    return blurred(kernel, features) / mass[:, None], blurred(kernel, confidence) / mass


def confidence_weighted(kernel: BlurKernel, features: Tensor, confidence: Tensor) -> Blurred:
    """Features as the mean of what is seen by its confidence; confidence by the whole window."""
    summed = blurred(kernel, confidence)
    weighted = blurred(kernel, features * confidence[:, None])
    return weighted / summed.clamp(min=1e-12)[:, None], summed


WAYS: tuple[Way, ...] = (whole, features_renormalised, both_renormalised, confidence_weighted)


def run(params: RimBenchParams) -> Iterator[dict[str, Any]]:
    """One row for each apartment and way."""
    for seed in params.seeds:
        frames = list(_frames(generate_apartment(seed, TRAINING), seed))
        truth = _Map(MapParams(blur_half_width_cells=0), whole)
        maps = [_Map(MapParams(), way) for way in WAYS]
        for number, field in enumerate(frames):
            truth.fuse(field)
            if number % params.every == 0:
                for each in maps:
                    each.fuse(field)
        for way, each in zip(WAYS, maps, strict=True):
            yield {"seed": seed, "way": way.__name__, **_compared(each, truth)}


class _Map:
    """Features of cells, blurred in one of the ways."""

    def __init__(self, params: MapParams, way: Way) -> None:
        self._params, self._way = params, way
        self.store = CellStore(CHANNELS, device=CPU, dtype=torch.float32, compiled=True)
        self.slots: dict[tuple[int, int], int] = {}
        self.views: dict[tuple[int, int], int] = {}

    def fuse(self, field: FeatureField) -> None:
        """Fuse a frame."""
        weights = images_of(field, self._params).weights()
        x_m, y_m = (float(value) for value in field.T_map_camera[:2, 3])
        kernel = blur_kernel(weights.cells, camera_xy_m=(x_m, y_m), params=self._params)
        patches = torch.from_numpy(field.features.reshape(-1, CHANNELS).astype(np.float32))
        features, confidence = self._way(
            kernel, cell_features(weights, patches), weights.confidence
        )
        keys = [(int(x), int(y)) for x, y in kernel.cells.numpy()]
        new = [k for k, key in enumerate(keys) if key not in self.slots]
        made = self.store.add(kernel.cells.numpy()[new])
        self.slots |= {keys[k]: int(slot) for k, slot in zip(new, made, strict=True)}
        slots = np.array([self.slots[key] for key in keys], np.int64)
        self.store.fuse(slots, features, confidence, revision=1)
        for x, y in weights.cells.numpy():
            key = (int(x), int(y))
            self.views[key] = self.views.get(key, 0) + 1


def _compared(found: _Map, truth: _Map) -> dict[str, Any]:
    """Mean of 1 - cosine with the unblurred map, by how a cell was seen, and by its variance.

    rim: cells that no pixel fell into, which have a feature by the blur only; few: seen at most
    ``FEW`` times. order: rank correlation of a cell's variance and its error.
    """
    both = [key for key in found.slots if key in truth.slots]
    ours = _unit(found.store.features(np.array([found.slots[key] for key in both])).numpy())
    theirs = _unit(truth.store.features(np.array([truth.slots[key] for key in both])).numpy())
    error = 1.0 - (ours * theirs).sum(axis=1)
    seen = np.array([found.views.get(key, 0) for key in both])
    variance = 1.0 / found.store.confidence.numpy()[[found.slots[key] for key in both]]
    groups = {"rim": seen == 0, "few": (seen > 0) & (seen <= FEW), "often": seen > FEW}
    report: dict[str, Any] = {"cells": len(both), "in_no_view": len(found.slots) - len(both)}
    for name, chosen in groups.items():
        report[f"{name}_cells"] = int(chosen.sum())
        report[f"{name}_error"] = round(float(error[chosen].mean()), 4) if chosen.any() else None
    weighted = float((error / variance).sum() / (1.0 / variance).sum())
    report["error_by_confidence"] = round(weighted, 4)
    report["order"] = round(float(np.corrcoef(_ranks(variance), _ranks(error))[0, 1]), 3)
    return report


def _frames(scene: Scene, seed: int) -> Iterator[FeatureField]:
    """Frames of a drive; a patch's feature is the mean of its pixels' categories' directions."""
    camera = CameraParams(width=SIZE[1], height=SIZE[0])
    rng, renderer = np.random.default_rng(seed), LabelRenderer(scene)
    names = [thing.category for thing in scene.objects]
    kinds = {name: k for k, name in enumerate(sorted(set(names)))}
    kind_of = np.array([*(kinds[name] for name in names), len(kinds)])  # the last: nothing
    directions = _unit(rng.standard_normal((len(kinds) + 1, CHANNELS)).astype(np.float32))
    for sequence, pose in enumerate(exploration_poses(scene, camera)):
        view = renderer.render(pose, camera.intrinsics, width=camera.width, height=camera.height)
        pixels = directions[kind_of[view.labels]]
        h, w = SIZE[0] // PATCH_PX, SIZE[1] // PATCH_PX
        patches = pixels.reshape(h, PATCH_PX, w, PATCH_PX, CHANNELS).mean(axis=(1, 3))
        depth_mm = measured_mm(view.depth_m, camera.min_depth_m, camera.max_depth_m)
        yield _field(sequence, pose, _unit(patches), depth_mm, camera.intrinsics)


def _field(
    sequence: int, pose: F64, patches: F32, depth_mm: np.ndarray, intrinsics: Intrinsics
) -> FeatureField:
    depth_m = np.divide(depth_mm, 1000, dtype=np.float32)
    return FeatureField(
        sequence=sequence,
        stamp_ns=(sequence + 1) * 250_000_000,
        encoder_id="benchmark",
        text_space="benchmark",
        features=patches.astype(np.float16),
        variance=observation_variance(depth_m, intrinsics, VarianceParams()),
        depth_mm=depth_mm,
        intrinsics=intrinsics,
        T_map_camera=pose,
    )


def _mass(kernel: BlurKernel) -> Tensor:
    """Share (n,) of each cell's window that was observed."""
    ends = torch.cat([kernel.starts[1:], kernel.starts.new_tensor([len(kernel.values)])])
    return torch.segment_reduce(kernel.values, "sum", lengths=ends - kernel.starts)


def _ranks(values: np.ndarray) -> np.ndarray:
    return np.argsort(np.argsort(values))


def _unit(rows: F32) -> F32:
    unit: F32 = rows / np.maximum(np.linalg.norm(rows, axis=-1, keepdims=True), 1e-12)
    return unit
