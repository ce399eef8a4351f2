"""State of a training: network, averaged network, optimizer and schedule, with its checkpoint."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor
from torch.optim.lr_scheduler import LambdaLR
from torch.optim.swa_utils import AveragedModel

from onemap_tools.train.network.backbone import fix_statistics, load_backbone_weights
from onemap_tools.train.network.mini_network import MiniNetwork
from onemap_tools.train.params import TrainParams
from onemap_tools.train.rounds import Rounds, TrainingRound, difference, dump_rounds, parse_rounds

CHECKPOINT = "checkpoint.safetensors"
FORMAT = "6"  # of the checkpoint; 5 has no rounds, 2 to 4 other weights that learn, 1 other names
SAME_NAMES = ("2", "3", "4", "5", FORMAT)  # formats whose averaged network can be read
MAX_GRADIENT_NORM = 5.0
NETWORK, AVERAGE, OPTIMIZER = "network", "average", "optimizer"


class TrainState:
    """All that a checkpoint holds.

    ``step``: optimizer steps done. ``rounds``: what the network was trained with, this training
    last. resumed: ``load`` follows, and the initial weights do not matter.
    """

    def __init__(
        self,
        params: TrainParams,
        this_round: TrainingRound,
        device: torch.device,
        *,
        resumed: bool = False,
    ) -> None:
        torch.manual_seed(params.seed)
        self.step = 0
        self.rounds: Rounds = (this_round,)
        if params.start_from is not None and not resumed:
            self.rounds = (*read_checkpoint_rounds(params.start_from), this_round)
        self.network = _initial_network(params, resumed=resumed).to(device)
        self.network.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        self._started = "begun anew" if params.start_from is None else "of another training"
        self._params = params
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
        tensors = {f"{NETWORK}.{k}": v for k, v in self.network.state_dict().items()}
        tensors |= {f"{AVERAGE}.{k}": v for k, v in self._average.state_dict().items()}
        for index, state in self._optimizer.state_dict()["state"].items():
            tensors |= {f"{OPTIMIZER}.{index}.{k}": v for k, v in state.items()}
        part = folder / f"{CHECKPOINT}.part"
        metadata = {
            "format": FORMAT,
            "step": str(self.step),
            "started": self._started,
            "rounds": dump_rounds(self.rounds),
        }
        save_file({k: v.contiguous() for k, v in tensors.items()}, part, metadata=metadata)
        part.replace(folder / CHECKPOINT)

    def load(self, folder: Path) -> None:
        """Continue from the checkpoint.

        Raises ValueError if an earlier release wrote it, or a training with other options.
        """
        sections: dict[str, dict[str, Tensor]] = {NETWORK: {}, AVERAGE: {}, OPTIMIZER: {}}
        with _open_checkpoint(folder, (FORMAT,), device=str(self._device)) as file:
            metadata = file.metadata()
            self._check_options(metadata, folder)
            for name in file.keys():  # noqa: SIM118 - not a dict
                section, _, key = name.partition(".")
                sections[section][key] = file.get_tensor(name)
        self.step = int(metadata["step"])
        self.network.load_state_dict(sections[NETWORK])
        self._average.load_state_dict(sections[AVERAGE])
        state: dict[int, dict[str, Tensor]] = {}
        for name, tensor in sections[OPTIMIZER].items():
            index, _, key = name.partition(".")
            state.setdefault(int(index), {})[key] = tensor
        groups = self._optimizer.state_dict()["param_groups"]
        self._optimizer.load_state_dict({"state": state, "param_groups": groups})
        self._schedule = self._schedule_from(self.step)

    def _check_options(self, metadata: dict[str, str], folder: Path) -> None:
        """Other options than the first time would make a network that no command describes."""
        *earlier, stored = parse_rounds(metadata["rounds"])
        other = difference(stored, self.rounds[-1])
        if not other and metadata["started"] != self._started:
            other = f"weights {metadata['started']} rather than {self._started}"
        if other:
            raise ValueError(
                f"{folder} holds a training with {other}: repeat its options, or choose another "
                "--work"
            )
        self.rounds = (*earlier, stored)

    def _schedule_from(self, step: int) -> LambdaLR:
        factor = partial(learning_rate_factor, params=self._params)
        return LambdaLR(self._optimizer, factor, last_epoch=step - 1)


def _initial_network(params: TrainParams, *, resumed: bool) -> MiniNetwork:
    """Random weights, ImageNet's in the backbone, or those of an earlier training."""
    network = MiniNetwork()
    if params.backbone_weights is not None:
        load_backbone_weights(network.backbone, params.backbone_weights)
        network.backbone.freeze_first()
    if params.start_from is not None:
        if not resumed:
            network.load_state_dict(load_averaged_network(params.start_from).state_dict())
        fix_statistics(network.backbone)
    return network


def load_averaged_network(folder: Path) -> MiniNetwork:
    """The averaged network of the checkpoint, in evaluation mode; ValueError without one."""
    network, prefix = MiniNetwork(), f"{AVERAGE}.module."
    with _open_checkpoint(folder, SAME_NAMES) as file:
        names = [name for name in file.keys() if name.startswith(prefix)]  # noqa: SIM118
        network.load_state_dict({n.removeprefix(prefix): file.get_tensor(n) for n in names})
    return network.eval()


def read_checkpoint_rounds(folder: Path) -> Rounds:
    """What the checkpoint was trained with, empty if its release did not write that down.

    ValueError without a checkpoint whose averaged network can be read.
    """
    with _open_checkpoint(folder, SAME_NAMES) as file:
        text = file.metadata().get("rounds")
    return () if text is None else parse_rounds(text)


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


@contextmanager
def _open_checkpoint(folder: Path, formats: tuple[str, ...], device: str = "cpu") -> Iterator[Any]:
    """The checkpoint's tensors; ValueError if it is missing, damaged or of another format."""
    path = folder / CHECKPOINT
    if not path.is_file():
        raise ValueError(f"{folder} holds no checkpoint: make one with 'onemap train train'")
    try:
        opened = safe_open(path, "pt", device=device)
    except SafetensorError as problem:
        raise ValueError(f"{path} is damaged: {problem}: remove it to train anew") from problem
    with opened as file:
        if (file.metadata() or {}).get("format") not in formats:
            raise ValueError(
                f"{path} was written by another release of onemap train: move it away to train anew"
            )
        yield file
