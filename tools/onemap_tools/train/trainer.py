"""The training loop of ``mini``: reproducible from a seed, resumable after an interruption."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from onemap_tools.train.data.batches import Batch, BatchSource, class_frequency
from onemap_tools.train.data.frame_dataset import FrameDataset
from onemap_tools.train.data.text_targets import TextBank
from onemap_tools.train.network.backbone import FROZEN_STRIDE
from onemap_tools.train.network.losses import (
    ClassWeighting,
    alignment_loss,
    class_weights,
    confusable_classes,
)
from onemap_tools.train.network.mini_network import MiniNetwork
from onemap_tools.train.params import TrainParams
from onemap_tools.train.rounds import TrainingRound
from onemap_tools.train.train_state import CHECKPOINT, TrainState

LOG_FILE = "log.jsonl"
LOSS_WEIGHT = 0.02  # of the newest step in the reported moving average


@dataclass(frozen=True, slots=True)
class TrainingProgress:
    """Steps done, steps in all and the moving average of the loss."""

    step: int
    steps: int
    loss: float


def train_mini(
    frames: FrameDataset,
    texts: TextBank,
    folder: Path,
    *,
    params: TrainParams,
    device: torch.device,
    report: Callable[[TrainingProgress], None],
) -> MiniNetwork:
    """Train on the frames and return the averaged network, in evaluation mode.

    Continues from a checkpoint in ``folder``; calls ``report`` after every step. Raises ValueError
    if that checkpoint is of a training with other options, or if the training diverges.
    """
    folder.mkdir(parents=True, exist_ok=True)
    frozen = 0 if params.backbone_weights is None else FROZEN_STRIDE
    this_round = TrainingRound(params.steps, params.seed, len(frames), frames.scenes, frozen)
    resumed = (folder / CHECKPOINT).exists()
    state = TrainState(params, this_round, device, resumed=resumed)
    if resumed:
        state.load(folder)
    loss_of = _BatchLoss(frames, texts, params, device)
    state.network.train()
    average_loss, log = math.nan, _Log(folder, state.step)
    for batch in BatchSource(frames, params).stream(state.step, params.total_steps):
        loss = loss_of(state.network, batch, state.step)
        state.optimize(loss)
        average_loss = _moving_average(average_loss, loss.item())
        progress = TrainingProgress(state.step, params.total_steps, average_loss)
        report(progress)
        if state.step % params.checkpoint_interval == 0 or state.step == params.total_steps:
            state.save(folder)
            log.append(progress)
    return state.averaged_network.eval()


class _BatchLoss:
    """The loss of a batch, with class texts and class weights on the device."""

    def __init__(
        self, frames: FrameDataset, texts: TextBank, params: TrainParams, device: torch.device
    ) -> None:
        frequency = class_frequency(frames)
        confusable = confusable_classes(frames.classes, params.hard_pairs).to(device)
        self._strong, self._weak = (
            ClassWeighting(class_weights(frequency, power).to(device), confusable)
            for power in (params.balance_power, params.weak_balance_power)
        )
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
        weighting = self._weak if step >= params.weak_from_step else self._strong
        return alignment_loss(rows, targets, self._texts.sample(generator), weighting, params.loss)


def _moving_average(average: float, value: float) -> float:
    """NaN: there is no average yet."""
    return value if math.isnan(average) else (1 - LOSS_WEIGHT) * average + LOSS_WEIGHT * value


class _Log:
    """A line of ``log.jsonl`` for every checkpoint, with the seconds a step took since the last."""

    def __init__(self, folder: Path, step: int) -> None:
        self._path = folder / LOG_FILE
        self._last = (step, time.perf_counter())

    def append(self, progress: TrainingProgress) -> None:
        step, since_s = self._last
        self._last = (progress.step, time.perf_counter())
        line = {
            "step": progress.step,
            "steps": progress.steps,
            "loss": round(progress.loss, 4),
            "step_s": round((self._last[1] - since_s) / (progress.step - step), 3),
        }
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
