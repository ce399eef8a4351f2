"""Parameters of the training, targets and loss per 8 x 8 patch, and batches.

A thread prepares the next batch during an optimizer step.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from onemap_perception.text.embeddings import EmbedTexts
from onemap_perception.text.vocabulary import Vocabulary
from onemap_shared.geometry import F32, U8
from onemap_tools.train.augmentation import augment_full_image, augment_strong, augment_weak
from onemap_tools.train.frames import NO_CLASS, FrameDataset


@dataclass(frozen=True, slots=True)
class TrainParams:
    """How ``mini`` is trained.

    Three phases: strong augmentation, from ``weak_from_step`` on mostly weak augmentation, and
    from ``steps`` on whole images.
    """

    steps: int  # of the optimizer, on cropped images
    seed: int  # of initial weights, batches, augmentation and aliases
    batch_size: int = 24  # cropped images per step; half as many whole images
    crop_px: tuple[int, int] = (224, 168)  # multiples of 8: half the area of a rendered image
    learning_rate: float = 2e-3  # peak of AdamW's, for the feature pyramid
    backbone_lr_scale: float = 0.25  # pretrained on ImageNet: it needs smaller steps
    weight_decay: float = 0.05  # decoupled; of weights, not of biases and norms
    warmup_steps: int = 200  # linear: Adam's first moments are noisy
    ema_decay: float = 0.998  # of the average that ships: a window of about 500 steps
    checkpoint_interval: int = 200  # steps that an interruption loses at most
    # Strong augmentation teaches shapes, the last steps the simulator's own appearance.
    weak_share: float = 0.36
    # Classes weigh as the inverse of their frequency to this power, so that small things are
    # learned at all; less at the end, because strong weights for rare classes cause false
    # positives.
    balance_power: float = 0.5
    weak_balance_power: float = 0.1
    # Steps after all others, as a share of them: a robot's images are never cropped.
    full_image_share: float = 0.1
    full_image_learning_rate: float = 4e-4  # peak
    # ImageNet's, of the backbone, whose first stages are then frozen; all is random without.
    backbone_weights: Path | None = None

    @property
    def total_steps(self) -> int:
        """Steps of all three phases."""
        return self.steps + round(self.steps * self.full_image_share)

    @property
    def weak_from_step(self) -> int:
        """First step of the phase with mostly weak augmentation."""
        return round(self.steps * (1 - self.weak_share))


TEMPERATURE = 20.0  # of the softmax: a cosine larger by 0.1 is e^2 times as probable
COSINE_WEIGHT = 0.5  # beside the cross-entropy, which alone leaves the absolute cosine free


def patch_targets(label: U8, classes: int, stride: int = 8) -> F32:
    """Share of every class in each patch, row by row: (B * H/stride * W/stride, K) float32.

    label (B, H, W) uint8; pixels of no class (>= K) count for none, so that the shares of a
    patch sum to how much of it is known.
    """
    batch, height, width = label.shape
    rows, columns = height // stride, width // stride
    patches = label.reshape(batch, rows, stride, columns, stride).transpose(0, 1, 3, 2, 4)
    flat = np.minimum(patches.reshape(-1, stride * stride), classes).astype(np.int64)
    index = flat + np.arange(len(flat))[:, None] * (classes + 1)
    counts = np.bincount(index.ravel(), minlength=len(flat) * (classes + 1))
    shares = counts.reshape(len(flat), classes + 1)[:, :classes]
    result: F32 = (shares / (stride * stride)).astype(np.float32)
    return result


def class_weights(frequency: F32, power: float) -> Tensor:
    """Weights (K,) as frequency to minus ``power``, of mean 1 over what is seen; frequency (K,)."""
    share = np.maximum(frequency / max(float(frequency.sum()), 1e-12), 1e-4)
    weights = share**-power
    weights /= float((weights * share).sum() / share.sum())
    return torch.from_numpy(weights.astype(np.float32))


def alignment_loss(features: Tensor, targets: Tensor, texts: Tensor, weights: Tensor) -> Tensor:
    """Mean over patches of the class-weighted cross-entropy plus the cosine to the target text.

    features (P, D) of any length; targets (P, K) shares of the classes; texts (K + M, D) unit
    rows, those after the K classes never right; weights (K,) of the classes.
    """
    # Dividing P x T cosines by the length is cheaper than making P x D features unit.
    cosine = features @ texts.T / features.norm(dim=1, keepdim=True).clamp_min(1e-6)
    classes = targets.shape[1]
    log_share = functional.log_softmax(TEMPERATURE * cosine, dim=1)[:, :classes]
    per_class = -log_share + COSINE_WEIGHT * (1 - cosine[:, :classes])
    weighted = targets * weights
    loss: Tensor = (weighted * per_class).sum() / weighted.sum().clamp_min(1e-6)
    return loss


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
        rgb, label = self.frames[index]
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
        counts += np.bincount(frames[index][1].ravel(), minlength=NO_CLASS + 1)
    known = counts[: len(frames.classes)].astype(np.float32)
    share: F32 = known / np.float32(max(int(known.sum()), 1))
    return share
