"""Training batches, made in a thread of their own while the network learns."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F32, U8
from onemap_tools.train.data.augmentation import augment_full_image, augment_strong, augment_weak
from onemap_tools.train.data.frame_dataset import NO_CLASS, FrameDataset
from onemap_tools.train.network.losses import patch_targets

WEAK_SHARE = 0.75  # of the pictures, in the last part of the training


@dataclass(frozen=True, slots=True)
class Batch:
    """rgb (B, h, w, 3) uint8; targets (B * h/8 * w/8, K) float32."""

    rgb: U8
    targets: F32


@dataclass(frozen=True, slots=True)
class BatchSource:
    """Batch number i is a function of seed and i alone, so that training can resume anywhere.

    From step ``finish_from`` on most pictures are changed mildly: strong changes teach what
    things are, the last steps what they look like here. From ``whole_from`` on a batch is half
    as many whole pictures: a robot never sees a crop.
    """

    frames: FrameDataset
    size: tuple[int, int]
    batch: int
    seed: int
    finish_from: int
    whole_from: int

    def make(self, step: int) -> Batch:
        """The batch of this step."""
        rng = np.random.default_rng([self.seed, step])
        whole = step >= self.whole_from
        chosen = rng.integers(0, len(self.frames), self.batch // 2 if whole else self.batch)
        pairs = [self._one(i, step, rng) for i in chosen]
        labels = np.stack([label for _, label in pairs])
        return Batch(
            np.stack([rgb for rgb, _ in pairs]), patch_targets(labels, len(self.frames.classes))
        )

    def _one(self, index: int, step: int, rng: np.random.Generator) -> tuple[U8, U8]:
        rgb, label = self.frames.rgb[index], self.frames.label[index]
        if step >= self.whole_from:
            return augment_full_image(rgb, label, rng)
        mild = step >= self.finish_from and rng.random() < WEAK_SHARE
        return (augment_weak if mild else augment_strong)(rgb, label, self.size, rng)

    def stream(self, first: int, last: int) -> Iterator[Batch]:
        """Batches of steps [first, last), prepared one ahead."""
        with ThreadPoolExecutor(1, "batches") as pool:
            coming = pool.submit(self.make, first)
            for step in range(first, last):
                batch = coming.result()
                if step + 1 < last:
                    coming = pool.submit(self.make, step + 1)
                yield batch


def class_frequency(frames: FrameDataset, rng: np.random.Generator, sample: int = 500) -> F32:
    """Share of the pixels of each class (K,) over some random frames."""
    chosen = rng.choice(len(frames), min(sample, len(frames)), replace=False)
    counts = np.zeros(NO_CLASS + 1, np.int64)
    for index in chosen:
        counts += np.bincount(frames.label[index].ravel(), minlength=NO_CLASS + 1)
    known = counts[: len(frames.classes)].astype(np.float32)
    share: F32 = known / np.float32(max(int(known.sum()), 1))
    return share
