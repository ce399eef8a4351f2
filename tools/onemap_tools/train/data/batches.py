"""Training batches, prepared by threads of their own during the optimizer's steps."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from onemap_shared.geometry import F32, F64, U8
from onemap_tools.train.data.augmentation import (
    augment_camera,
    augment_full_image,
    augment_strong,
    augment_weak,
)
from onemap_tools.train.data.frame_dataset import NAMELESS, FrameDataset
from onemap_tools.train.data.sampling import frame_probabilities, shown_classes
from onemap_tools.train.network.losses import patch_targets
from onemap_tools.train.params import TrainParams


@dataclass(frozen=True, slots=True)
class Batch:
    """rgb (B, h, w, 3) uint8; targets (B * h/8 * w/8, K + 1) float32, the last: no name."""

    rgb: U8
    targets: F32


@dataclass(frozen=True, slots=True)
class BatchSource:
    """Batch number i is a function of seed and i alone, so that training can resume anywhere.

    In the phase on whole images a batch holds half as many.
    """

    frames: FrameDataset
    params: TrainParams
    probabilities: F64 = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "probabilities", frame_probabilities(self.frames, self.params))

    def make(self, step: int) -> Batch:
        """The batch of this step."""
        params = self.params
        rng = np.random.default_rng([params.seed, step])
        count = params.batch_size // 2 if step >= params.steps else params.batch_size
        chosen = rng.choice(len(self.frames), count, p=self.probabilities)
        pairs = [self._augmented(int(i), step, rng) for i in chosen]
        labels = np.stack([label for _, label in pairs])
        return Batch(
            np.stack([rgb for rgb, _ in pairs]), named_targets(labels, len(self.frames.classes))
        )

    def _augmented(self, index: int, step: int, rng: np.random.Generator) -> tuple[U8, U8]:
        rgb, label = self.frames.rgb[index], self.frames.label[index]
        weak = rng.random() < self.params.weakly_augmented
        if step >= self.params.steps:
            return (augment_full_image if weak else augment_camera)(rgb, label, rng)
        weak = weak and step >= self.params.weak_from_step
        return (augment_weak if weak else augment_strong)(rgb, label, self.params.crop_px, rng)

    def stream(self, first: int, last: int) -> Iterator[Batch]:
        """Batches of steps [first, last), prepared ahead, one by each thread."""
        threads = self.params.batch_threads
        with ThreadPoolExecutor(threads, "batches") as pool:
            upcoming: deque[Future[Batch]] = deque()
            for step in range(first, min(first + threads, last)):
                upcoming.append(pool.submit(self.make, step))
            for step in range(first, last):
                batch = upcoming.popleft().result()
                if step + threads < last:
                    upcoming.append(pool.submit(self.make, step + threads))
                yield batch


def named_targets(label: U8, classes: int) -> F32:
    """Shares (P, K + 1) of the classes and, last, of things without a name, in every patch."""
    return patch_targets(np.where(label == NAMELESS, np.uint8(classes), label), classes + 1)


def class_frequency(frames: FrameDataset) -> F32:
    """Share of the labelled pixels (K + 1,) of each class and of things without a name."""
    counts = shown_classes(frames).sum(axis=0)
    share: F32 = (counts / max(int(counts.sum()), 1)).astype(np.float32)
    return share
