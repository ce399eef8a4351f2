"""Training batches, prepared by a thread of their own during the optimizer's steps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from onemap_perception.text.embeddings import EmbedTexts
from onemap_perception.text.vocabulary import Vocabulary
from onemap_shared.geometry import F32, U8
from onemap_tools.train.augmentation import augment_full_image, augment_strong, augment_weak
from onemap_tools.train.frames import NO_CLASS, FrameDataset
from onemap_tools.train.losses import patch_targets
from onemap_tools.train.params import TrainParams

WEAKLY_AUGMENTED = 0.75  # share of the images from ``weak_from_step`` on
FREQUENCY_FRAMES = 500  # from which the classes' frequencies are estimated


@dataclass(frozen=True, slots=True)
class TextBank:
    """aliases (K, A, D) unit rows, repeated where a class has fewer than A; neutral (M, D)."""

    aliases: Tensor
    neutral: Tensor

    def sample(self, generator: torch.Generator) -> Tensor:
        """One random alias of every class, then the neutral words: (K + M, D)."""
        classes, count, _ = self.aliases.shape
        chosen = torch.randint(count, (classes,), generator=generator)
        return torch.cat([self.aliases[torch.arange(classes), chosen], self.neutral])


def build_text_bank(vocabulary: Vocabulary, embed: EmbedTexts) -> TextBank:
    """Embeddings of all training words, each in the vocabulary's prompt."""

    def rows(words: Sequence[str]) -> Tensor:
        return torch.from_numpy(embed([vocabulary.prompt.format(word) for word in words]))

    longest = max(len(entry.aliases) for entry in vocabulary.classes)
    padded = [
        [entry.aliases[index % len(entry.aliases)] for index in range(longest)]
        for entry in vocabulary.classes
    ]
    return TextBank(
        torch.stack([rows(aliases) for aliases in padded]), rows(list(vocabulary.neutral))
    )


@dataclass(frozen=True, slots=True)
class Batch:
    """rgb (B, h, w, 3) uint8; targets (B * h/8 * w/8, K) float32."""

    rgb: U8
    targets: F32


@dataclass(frozen=True, slots=True)
class BatchSource:
    """Batch number i is a function of seed and i alone, so that training can resume anywhere.

    In the phase on whole images a batch holds half as many.
    """

    frames: FrameDataset
    params: TrainParams

    def make(self, step: int) -> Batch:
        """The batch of this step."""
        params = self.params
        rng = np.random.default_rng([params.seed, step])
        count = params.batch_size // 2 if step >= params.steps else params.batch_size
        chosen = rng.integers(0, len(self.frames), count)
        pairs = [self._augmented(i, step, rng) for i in chosen]
        labels = np.stack([label for _, label in pairs])
        return Batch(
            np.stack([rgb for rgb, _ in pairs]), patch_targets(labels, len(self.frames.classes))
        )

    def _augmented(self, index: int, step: int, rng: np.random.Generator) -> tuple[U8, U8]:
        rgb, label = self.frames.rgb[index], self.frames.label[index]
        if step >= self.params.steps:
            return augment_full_image(rgb, label, rng)
        weak = step >= self.params.weak_from_step and rng.random() < WEAKLY_AUGMENTED
        return (augment_weak if weak else augment_strong)(rgb, label, self.params.crop_px, rng)

    def stream(self, first: int, last: int) -> Iterator[Batch]:
        """Batches of steps [first, last), prepared one ahead."""
        with ThreadPoolExecutor(1, "batches") as pool:
            upcoming = pool.submit(self.make, first)
            for step in range(first, last):
                batch = upcoming.result()
                if step + 1 < last:
                    upcoming = pool.submit(self.make, step + 1)
                yield batch


def class_frequency(frames: FrameDataset, rng: np.random.Generator) -> F32:
    """Share of the labelled pixels of each class (K,) float32 over some random frames."""
    chosen = rng.choice(len(frames), min(FREQUENCY_FRAMES, len(frames)), replace=False)
    counts = np.zeros(NO_CLASS + 1, np.int64)
    for index in chosen:
        counts += np.bincount(frames.label[index].ravel(), minlength=NO_CLASS + 1)
    known = counts[: len(frames.classes)].astype(np.float32)
    share: F32 = known / np.float32(max(int(known.sum()), 1))
    return share
