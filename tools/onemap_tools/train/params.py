"""Parameters of the training of ``mini``; the command line sets steps and seed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


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
