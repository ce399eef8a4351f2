"""Parameters of the training of ``mini``; the command line sets some, the rest are defaults."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from onemap_shared.params import Params


class LossParams(Params):
    """Weights of the alignment loss."""

    temperature: float = Field(
        default=20.0,
        gt=0,
        description="Factor of the cosines in the softmax of the cross-entropy: a cosine larger by "
        "0.1 than another is e^2 times as probable.",
    )
    cosine_weight: float = Field(
        default=0.5,
        ge=0,
        description="Weight of 1 - cosine to the target text beside the cross-entropy, which "
        "alone leaves the absolute cosine free.",
    )
    margin: float = Field(
        default=1.0,
        ge=0,
        description="Added to the logits of the classes that the true one is often taken for: it "
        "has to be e times as probable as they.",
    )


# What is taken for each other, on the shipped card and in homes.
HARD_PAIRS = (
    ("wardrobe", "door"),
    ("wardrobe", "wall"),
    ("refrigerator", "wall"),
    ("refrigerator", "wardrobe"),
    ("refrigerator", "door"),
    ("bed", "sofa"),
    ("armchair", "sofa"),
    ("armchair", "chair"),
    ("desk", "dresser"),
    ("desk", "table"),
    ("shelf", "wall"),
    ("shelf", "bookcase"),
    ("television", "window"),
    ("television", "picture"),
    ("mirror", "window"),
    ("lamp", "wall"),
)


class TrainParams(Params):
    """How ``mini`` is trained.

    Three phases: strong augmentation, from ``weak_from_step`` on mostly weak augmentation, and
    from ``steps`` on whole images.
    """

    steps: int = Field(
        ge=1, description="Optimizer steps on cropped images; set by the command line."
    )
    batch_size: int = Field(
        default=24, ge=2, description="Cropped images per step; half as many whole images."
    )
    crop_px: tuple[int, int] = Field(
        default=(224, 168),
        description="Width and height of the crops in pixels, multiples of 8: half the area of a "
        "rendered image of 320 x 240.",
    )
    learning_rate: float = Field(
        default=2e-3, gt=0, description="Peak learning rate of AdamW for the feature pyramid."
    )
    backbone_lr_scale: float = Field(
        default=0.25,
        gt=0,
        description="Learning rate of the backbone over that of the pyramid; it is pretrained "
        "on ImageNet and needs smaller steps.",
    )
    weight_decay: float = Field(
        default=0.05, ge=0, description="Decoupled weight decay of weights, not biases and norms."
    )
    warmup_steps: int = Field(
        default=200,
        ge=1,
        description="Steps of linear learning-rate warm-up: Adam's first moments are noisy.",
    )
    ema_decay: float = Field(
        default=0.998,
        ge=0,
        lt=1,
        description="Decay per step of the moving average of the weights, which is what ships: "
        "a window of about 500 steps.",
    )
    seed: int = Field(
        ge=0, description="Seed of initial weights, batches, augmentation and aliases."
    )
    checkpoint_interval: int = Field(
        default=200,
        ge=1,
        description="Steps between checkpoints: work lost by an interruption, at most.",
    )
    weak_share: float = Field(
        default=0.36,
        ge=0,
        le=1,
        description="Share of the steps, at the end, with mostly weak augmentation: strong "
        "augmentation teaches shapes, the last steps the simulator's own appearance.",
    )
    balance_power: float = Field(
        default=0.5,
        ge=0,
        description="Classes weigh as the inverse of their frequency to this power, so that "
        "small things are learned at all.",
    )
    weak_balance_power: float = Field(
        default=0.1,
        ge=0,
        description="The same during weak augmentation; lower, because strong weights for rare "
        "classes cause false positives.",
    )
    hard_pairs: tuple[tuple[str, str], ...] = Field(
        default=HARD_PAIRS,
        description="Pairs of classes that are taken for each other: frames that show one of "
        "them are drawn more often, and the loss asks for a margin between them.",
    )
    rare_power: float = Field(
        default=0.5,
        ge=0,
        description="Frames are drawn by the inverse of how many show their rarest classes, to "
        "this power; 0 draws all alike.",
    )
    hard_share: float = Field(
        default=0.5,
        ge=0,
        description="How much more often a frame with a class of a hard pair is drawn; 0.5 is "
        "half as often again.",
    )
    weakly_augmented: float = Field(
        default=0.4,
        ge=0,
        le=1,
        description="Share of the images with weak augmentation from ``weak_from_step`` on, and "
        "of the whole images; the rest keep the network used to other cameras.",
    )
    full_image_share: float = Field(
        default=0.1,
        ge=0,
        description="Steps on whole images after all others, as a share of ``steps``; a robot's "
        "images are never cropped.",
    )
    full_image_learning_rate: float = Field(
        default=4e-4, gt=0, description="Peak learning rate of the phase on whole images."
    )
    loss: LossParams = Field(default=LossParams(), description="Weights of the loss.")
    batch_threads: int = Field(
        default=1,
        ge=1,
        description="Threads that prepare batches ahead, which does not change them: one keeps "
        "up with a CPU, a GPU waits for more.",
    )
    backbone_weights: Path | None = Field(
        default=None,
        description="Checkpoint with ImageNet weights of the backbone, whose first stages are "
        "then frozen; all weights are random without it.",
    )
    start_from: Path | None = Field(
        default=None,
        description="Folder of an earlier training's checkpoint, whose averaged network this one "
        "starts from. The statistics of the backbone's batch norms then stay as they are (as "
        "Chen et al., 'Rethinking Atrous Convolution' (2017), section 4.1).",
    )

    @property
    def total_steps(self) -> int:
        """Steps of all three phases."""
        return self.steps + round(self.steps * self.full_image_share)

    @property
    def weak_from_step(self) -> int:
        """First step of the phase with mostly weak augmentation."""
        return round(self.steps * (1 - self.weak_share))
