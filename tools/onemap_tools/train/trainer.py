"""The training loop of ``mini``: reproducible from a seed, resumable after an interruption."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.optim.lr_scheduler import LambdaLR
from torch.optim.swa_utils import AveragedModel

from onemap_shared.atomic_file import replacing
from onemap_tools.train.batches import (
    Batch,
    BatchSource,
    TextBank,
    TrainParams,
    alignment_loss,
    class_frequency,
    class_weights,
)
from onemap_tools.train.frames import FrameDataset
from onemap_tools.train.network import MiniNetwork, load_backbone_weights

CHECKPOINT = "checkpoint.pt"
LOSS_WEIGHT = 0.02  # of the newest step in the reported moving average
MAX_GRADIENT_NORM = 5.0
NETWORK, AVERAGE, OPTIMIZER = "network", "average", "optimizer"


@dataclass(frozen=True, slots=True)
class TrainingRecord:
    """What a network is trained with; kept in its checkpoint and beside its weights."""

    steps: int
    seed: int
    pictures: int
    apartments: int

    def difference(self, asked: TrainingRecord) -> str:
        """In words, what differs: "steps 7500 rather than 5000, seed 0 rather than 1"."""
        other = asdict(asked)
        return ", ".join(
            f"{name} {value} rather than {other[name]}"
            for name, value in asdict(self).items()
            if value != other[name]
        )


def train_mini(
    frames: FrameDataset,
    texts: TextBank,
    folder: Path,
    *,
    params: TrainParams,
    device: torch.device,
    report: Callable[[int, float], None],
) -> MiniNetwork:
    """Train on the frames and return the averaged network, in evaluation mode.

    Continues from a checkpoint in ``folder``; ``report`` is given the steps done and the moving
    average of the loss, after every step. Raises ValueError if that checkpoint is of a training
    with other options, or if the training diverges.
    """
    folder.mkdir(parents=True, exist_ok=True)
    record = TrainingRecord(params.steps, params.seed, len(frames), len(frames.images))
    state = TrainState(params, record, device)
    if (folder / CHECKPOINT).exists():
        state.load(folder)
    loss_of = _BatchLoss(frames, texts, params, device)
    state.network.train()
    average = math.nan
    for batch in BatchSource(frames, params).stream(state.step, params.total_steps):
        loss = loss_of(state.network, batch, state.step)
        state.optimize(loss)
        new = loss.item()
        average = new if math.isnan(average) else (1 - LOSS_WEIGHT) * average + LOSS_WEIGHT * new
        report(state.step, average)
        if state.step % params.checkpoint_interval == 0 or state.step == params.total_steps:
            state.save(folder)
    return state.averaged_network.eval()


class TrainState:
    """All that a checkpoint holds. ``step``: optimizer steps done."""

    def __init__(self, params: TrainParams, record: TrainingRecord, device: torch.device) -> None:
        torch.manual_seed(params.seed)
        self.step = 0
        self.network = MiniNetwork().to(device)
        if params.backbone_weights is not None:
            load_backbone_weights(self.network.backbone, params.backbone_weights)
            self.network.backbone.freeze()
        self.network.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        self._params = params
        self._record = record
        self._device = device
        self._average = AveragedModel(
            self.network, avg_fn=partial(average_tensor, params.ema_decay), use_buffers=True
        )
        self._average.update_parameters(self.network)  # the first one copies
        self._optimizer = torch.optim.AdamW(_parameter_groups(self.network, params))
        self._schedule = self._schedule_from(step=0)

    @property
    def averaged_network(self) -> MiniNetwork:
        """Moving average of weights and batch-norm statistics: what is exported."""
        network = self._average.module
        assert isinstance(network, MiniNetwork)
        return network

    def optimize(self, loss: Tensor) -> None:
        """One optimizer step on the loss; updates the averaged network and the learning rate.

        Raises ValueError before any weight becomes NaN: the checkpoint before stays good.
        """
        self._optimizer.zero_grad(set_to_none=True)
        torch.autograd.backward(loss)
        norm = torch.nn.utils.clip_grad_norm_(self.network.parameters(), MAX_GRADIENT_NORM)
        if not torch.isfinite(norm):
            raise ValueError(
                f"the training diverged in step {self.step + 1}, loss {loss.item():g}: "
                "try another --seed, in another --work"
            )
        self._optimizer.step()
        self.step += 1
        self._average.update_parameters(self.network)
        self._schedule.step()

    def save(self, folder: Path) -> None:
        """Write the checkpoint; an interruption while writing leaves the previous one."""
        state = {
            "step": self.step,
            "record": asdict(self._record),
            NETWORK: self.network.state_dict(),
            AVERAGE: self._average.state_dict(),
            OPTIMIZER: self._optimizer.state_dict(),
        }
        with replacing(folder / CHECKPOINT) as file:
            torch.save(state, file)

    def load(self, folder: Path) -> None:
        """Continue from the checkpoint.

        Raises ValueError if another release wrote it, or a training with other options: that
        would make a network that no command describes.
        """
        state = _checkpoint(folder, self._device, self.network)
        if other := TrainingRecord(**state["record"]).difference(self._record):
            raise ValueError(
                f"{folder} holds a training with {other}: repeat its options, or choose "
                "another --work"
            )
        self.step = state["step"]
        self.network.load_state_dict(state[NETWORK])
        self._average.load_state_dict(state[AVERAGE])
        self._optimizer.load_state_dict(state[OPTIMIZER])
        self._schedule = self._schedule_from(self.step)

    def _schedule_from(self, step: int) -> LambdaLR:
        factor = partial(learning_rate_factor, params=self._params)
        return LambdaLR(self._optimizer, factor, last_epoch=step - 1)


def load_averaged_network(folder: Path) -> tuple[MiniNetwork, TrainingRecord]:
    """The checkpoint's averaged network, in evaluation mode, and what it was trained with.

    ValueError without one.
    """
    network, prefix = MiniNetwork(), "module."
    state = _checkpoint(folder, torch.device("cpu"), network)
    tensors = {n.removeprefix(prefix): t for n, t in state[AVERAGE].items() if n.startswith(prefix)}
    network.load_state_dict(tensors)
    return network.eval(), TrainingRecord(**state["record"])


def _checkpoint(folder: Path, device: torch.device, network: MiniNetwork) -> dict[str, Any]:
    """What was saved; ValueError if it is missing, damaged or of another network."""
    path = folder / CHECKPOINT
    if not path.is_file():
        raise ValueError(f"{folder} holds no checkpoint: make one with 'onemap train mini'")
    try:
        state: dict[str, Any] = torch.load(path, map_location=device, weights_only=True)
    except Exception as problem:  # of torch, pickle and zipfile
        raise ValueError(f"{path} is damaged: {problem}: remove it to train anew") from problem
    if state.get(NETWORK, {}).keys() != network.state_dict().keys():
        raise ValueError(
            f"{path} was written by another release of onemap train: move it away to train anew"
        )
    return state


def learning_rate_factor(step: int, params: TrainParams) -> float:
    """Learning rate of a step over the peak rate.

    Linear warm-up and a half cosine to zero on crops, then another half cosine on whole images.
    """
    if step < params.warmup_steps:
        return (step + 1) / params.warmup_steps
    if step < params.steps:
        return _half_cosine((step - params.warmup_steps) / (params.steps - params.warmup_steps))
    peak = params.full_image_learning_rate / params.learning_rate
    return peak * _half_cosine((step - params.steps) / max(params.total_steps - params.steps, 1))


def average_tensor(decay: float, average: Tensor, current: Tensor, count: Tensor | int) -> Tensor:
    """Exponential moving average after ``count`` updates; counters are copied.

    The decay grows from 2/11, so that the random initial weights are soon forgotten.
    """
    if not average.dtype.is_floating_point:
        return current
    done = int(count)
    return torch.lerp(average, current, 1 - min(decay, (1 + done) / (10 + done)))


def _half_cosine(progress: float) -> float:
    """From 1 at progress 0 to 0 at progress 1."""
    return 0.5 * (1 + math.cos(math.pi * progress))


def _parameter_groups(network: MiniNetwork, params: TrainParams) -> list[dict[str, Any]]:
    """Trainable parameters by learning rate; weights decay, biases and norms do not."""
    backbone = set(network.backbone.parameters())
    return [
        {
            "params": [
                p
                for p in network.parameters()
                if p.requires_grad and (p in backbone, p.ndim > 1) == (in_backbone, decays)
            ],
            "lr": params.learning_rate * (params.backbone_lr_scale if in_backbone else 1.0),
            "weight_decay": params.weight_decay if decays else 0.0,
        }
        for in_backbone in (False, True)
        for decays in (False, True)
    ]


class _BatchLoss:
    """The loss of a batch, with class texts and class weights on the device."""

    def __init__(
        self, frames: FrameDataset, texts: TextBank, params: TrainParams, device: torch.device
    ) -> None:
        frequency = class_frequency(frames, np.random.default_rng(params.seed))
        self._strong_weights = class_weights(frequency, params.balance_power).to(device)
        self._weak_weights = class_weights(frequency, params.weak_balance_power).to(device)
        self._texts = TextBank(texts.aliases.to(device), texts.neutral.to(device))
        self._params = params
        self._device = device

    def __call__(self, network: MiniNetwork, batch: Batch, step: int) -> Tensor:
        """Forward pass in bfloat16, loss in float32."""
        params = self._params
        generator = torch.Generator().manual_seed(params.seed * 1_000_003 + step)
        rgb = torch.from_numpy(batch.rgb).to(self._device).permute(0, 3, 1, 2).float()
        targets = torch.from_numpy(batch.targets).to(self._device)
        with torch.autocast(self._device.type, torch.bfloat16):
            features = network.forward_features(rgb.contiguous(memory_format=torch.channels_last))
        # Channels lie last in memory: this is a view, and so is its gradient.
        rows = features.permute(0, 2, 3, 1).flatten(0, 2).float()
        weights = self._weak_weights if step >= params.weak_from_step else self._strong_weights
        return alignment_loss(rows, targets, self._texts.sample(generator), weights)
