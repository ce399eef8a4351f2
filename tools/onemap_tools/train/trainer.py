"""The training loop of ``mini``: reproducible from a seed, resumable after an interruption."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import safe_open
from safetensors.torch import save_file
from torch import Tensor

from onemap_tools.train.data.batches import BatchSource, class_frequency
from onemap_tools.train.data.frame_dataset import FrameDataset
from onemap_tools.train.data.text_targets import TextBank
from onemap_tools.train.network.backbone import load_backbone_weights
from onemap_tools.train.network.losses import LossParams, alignment_loss, class_weights
from onemap_tools.train.network.mini_network import MiniNetwork

CHECKPOINT = "checkpoint.safetensors"


@dataclass(frozen=True, slots=True)
class TrainParams:
    """How to train; steps of ``batch`` pictures of ``size`` = (w, h) pixels.

    The trunk, which has seen ImageNet, learns with ``trunk_rate`` times the learning rate.
    ``trunk`` is the file with its weights, whose finest layers stay as they are; without it all
    begins at random. ``finish`` is the share of the steps, at the end, with mostly mild
    augmentation and with rare classes favoured less, so that a cup is not seen in every edge.
    ``balance`` and ``finish_balance`` are the powers of the inverse class frequency before and
    in it. After all this come ``whole`` times as many steps on whole pictures, from
    ``whole_rate`` down.
    """

    steps: int = 4000
    batch: int = 24
    size: tuple[int, int] = (224, 168)
    learning_rate: float = 2e-3
    trunk_rate: float = 0.25
    weight_decay: float = 0.05
    warmup: int = 200
    ema: float = 0.998
    seed: int = 0
    checkpoint_every: int = 200
    finish: float = 0.36
    balance: float = 0.5
    finish_balance: float = 0.1
    whole: float = 0.1
    whole_rate: float = 4e-4
    loss: LossParams = field(default_factory=LossParams)
    trunk: Path | None = None

    @property
    def total(self) -> int:
        """All steps, those on whole pictures too."""
        return self.steps + round(self.steps * self.whole)

    @property
    def finish_from(self) -> int:
        """The step with which the mild part begins."""
        return round(self.steps * (1 - self.finish))

    def batches(self, frames: FrameDataset) -> BatchSource:
        """What is shown, step by step."""
        return BatchSource(
            frames,
            self.size,
            self.batch,
            self.seed,
            finish_from=self.finish_from,
            whole_from=self.steps,
        )


@dataclass(frozen=True, slots=True)
class TrainingProgress:
    """Where training stands: step of steps and the loss, averaged over the last steps."""

    step: int
    steps: int
    loss: float


class _Trainer:
    """Network, its running average and the optimiser: all that a checkpoint holds."""

    def __init__(self, settings: TrainParams, device: torch.device) -> None:
        torch.manual_seed(settings.seed)
        self.settings = settings
        self.device = device
        self.step = 0
        self.network = MiniNetwork().to(device)
        if settings.trunk is not None:
            load_backbone_weights(self.network.trunk, settings.trunk)
            self.network.trunk.freeze()
        self.network.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        self.average = MiniNetwork().to(device)
        self.average.load_state_dict(self.network.state_dict())
        self.optimiser = torch.optim.AdamW(_parameter_groups(self.network, settings))

    def rate(self) -> float:
        """Learning rate of this step: linear warm-up, then half a cosine to zero, and another."""
        s = self.settings
        if self.step < s.warmup:
            return s.learning_rate * (self.step + 1) / s.warmup
        if self.step < s.steps:
            progress = (self.step - s.warmup) / max(s.steps - s.warmup, 1)
            return s.learning_rate * 0.5 * (1 + math.cos(math.pi * progress))
        progress = (self.step - s.steps) / (s.total - s.steps)
        return s.whole_rate * 0.5 * (1 + math.cos(math.pi * progress))

    def learn(self, loss: Tensor) -> None:
        """One step down the gradient; the average follows."""
        for group in self.optimiser.param_groups:
            group["lr"] = self.rate() * group["scale"]
        self.optimiser.zero_grad(set_to_none=True)
        torch.autograd.backward(loss)
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 5.0)
        self.optimiser.step()
        self.step += 1
        keep = min(self.settings.ema, (1 + self.step) / (10 + self.step))
        source = self.network.state_dict()
        for name, mean in self.average.state_dict().items():
            if mean.dtype.is_floating_point:
                mean.lerp_(source[name], 1 - keep)
            else:
                mean.copy_(source[name])

    def save(self, folder: Path) -> None:
        """Write the checkpoint; a crash while writing leaves the one before."""
        tensors = {f"network.{k}": v.contiguous() for k, v in self.network.state_dict().items()}
        tensors |= {f"average.{k}": v.contiguous() for k, v in self.average.state_dict().items()}
        for index, state in self.optimiser.state_dict()["state"].items():
            tensors |= {f"optimiser.{index}.{k}": v.contiguous() for k, v in state.items()}
        fresh = folder / f"{CHECKPOINT}.part"
        steps = {"step": str(self.step), "steps": str(self.settings.total)}
        save_file(tensors, fresh, metadata=steps)
        fresh.replace(folder / CHECKPOINT)

    def load(self, folder: Path) -> None:
        """Go on from the checkpoint."""
        parts: dict[str, dict[str, Tensor]] = {"network": {}, "average": {}, "optimiser": {}}
        with safe_open(folder / CHECKPOINT, "pt", device=str(self.device)) as file:
            metadata = file.metadata()
            for name in file.keys():  # noqa: SIM118 - not a dict
                part, _, rest = name.partition(".")
                parts[part][rest] = file.get_tensor(name)
        self.step = int(metadata["step"])
        self.network.load_state_dict(parts["network"])
        self.average.load_state_dict(parts["average"])
        state: dict[int, dict[str, Tensor]] = {}
        for name, tensor in parts["optimiser"].items():
            index, _, key = name.partition(".")
            state.setdefault(int(index), {})[key] = tensor
        self.optimiser.load_state_dict(
            {"state": state, "param_groups": self.optimiser.state_dict()["param_groups"]}
        )


def _parameter_groups(network: MiniNetwork, settings: TrainParams) -> list[dict[str, Any]]:
    """Parameters by learning rate; weights decay, biases and norms do not."""
    trunk = set(network.trunk.parameters())
    return [
        {
            "params": [
                p
                for p in network.parameters()
                if p.requires_grad and (p in trunk, p.ndim > 1) == (in_trunk, decays)
            ],
            "scale": settings.trunk_rate if in_trunk else 1.0,
            "weight_decay": settings.weight_decay if decays else 0.0,
        }
        for in_trunk in (False, True)
        for decays in (False, True)
    ]


def train_mini(
    frames: FrameDataset,
    texts: TextBank,
    folder: Path,
    *,
    settings: TrainParams,
    device: torch.device,
    report: Callable[[TrainingProgress], None],
) -> MiniNetwork:
    """Train on the frames and return the averaged network, ready to evaluate.

    Goes on from a checkpoint in ``folder``. Computes in bfloat16 where that is safe.
    """
    folder.mkdir(parents=True, exist_ok=True)
    training = _Trainer(settings, device)
    if (folder / CHECKPOINT).exists():
        training.load(folder)
    rng = np.random.default_rng(settings.seed)
    frequency = class_frequency(frames, rng)
    balanced = class_weights(frequency, settings.balance).to(device)
    finishing = class_weights(frequency, settings.finish_balance).to(device)
    bank = replace(texts, aliases=texts.aliases.to(device), neutral=texts.neutral.to(device))
    source = settings.batches(frames)
    training.network.train()
    recent = math.nan
    for batch in source.stream(training.step, settings.total):
        generator = torch.Generator().manual_seed(settings.seed * 1_000_003 + training.step)
        rgb = torch.from_numpy(batch.rgb).to(device).permute(0, 3, 1, 2).float()
        targets = torch.from_numpy(batch.targets).to(device)
        with torch.autocast(device.type, torch.bfloat16):
            features = training.network.forward_unnormalised(
                rgb.contiguous(memory_format=torch.channels_last)
            )
        # Channels lie last in memory: this is a view, and so is its gradient.
        rows = features.permute(0, 2, 3, 1).flatten(0, 2).float()
        weights = balanced if training.step < settings.finish_from else finishing
        loss = alignment_loss(rows, targets, bank.draw(generator), weights, settings.loss)
        training.learn(loss)
        value = loss.item()
        recent = value if math.isnan(recent) else 0.98 * recent + 0.02 * value
        report(TrainingProgress(training.step, settings.total, recent))
        if training.step % settings.checkpoint_every == 0 or training.step == settings.total:
            training.save(folder)
            _append_log(folder, TrainingProgress(training.step, settings.total, recent))
    return training.average.eval()


def load_average(folder: Path) -> MiniNetwork:
    """The averaged network of the newest checkpoint."""
    network = MiniNetwork()
    with safe_open(folder / CHECKPOINT, "pt") as file:
        names = [name for name in file.keys() if name.startswith("average.")]  # noqa: SIM118
        network.load_state_dict({n.removeprefix("average."): file.get_tensor(n) for n in names})
    return network.eval()


def _append_log(folder: Path, report: TrainingProgress) -> None:
    with (folder / "log.jsonl").open("a", encoding="utf-8") as file:
        line = {"step": report.step, "steps": report.steps, "loss": round(report.loss, 4)}
        file.write(json.dumps(line) + "\n")
