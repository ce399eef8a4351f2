"""Network, loss, schedule, checkpoint and loop: the training repeats itself, resumes and learns."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from onemap_tools.train import batches, trainer
from onemap_tools.train.network import Backbone, MiniNetwork, load_backbone_weights
from tests.tools.train.tiny import VOCABULARY, embed, tiny_frames, tiny_params

CPU = torch.device("cpu")
PARAMS = tiny_params(steps=100, warmup_steps=10, full_image_share=0.2)
RECORD = trainer.TrainingRecord(steps=100, seed=0, pictures=6, apartments=1)


def test_weights_of_another_network_are_refused(tmp_path: Path) -> None:
    torch.save({"_conv_stem.weight": torch.zeros(3)}, tmp_path / "other.pth")
    with pytest.raises(ValueError, match="does not hold the backbone"):
        load_backbone_weights(Backbone(), tmp_path / "other.pth")


def loss_of(state: trainer.TrainState, step: int) -> torch.Tensor:
    """Some loss that depends on all weights."""
    generator = torch.Generator().manual_seed(step)
    rgb = torch.rand(2, 3, 32, 32, generator=generator) * 255
    return state.network.forward_features(rgb).square().mean()


def test_a_checkpoint_that_does_not_fit_is_not_gone_on_with(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="holds no checkpoint: make one with"):
        trainer.load_averaged_network(tmp_path)
    trainer.TrainState(PARAMS, RECORD, CPU).save(tmp_path)
    other = trainer.TrainState(PARAMS, replace(RECORD, steps=7, pictures=12), CPU)
    with pytest.raises(ValueError, match=r"steps 100 rather than 7, pictures 6 rather than 12: re"):
        other.load(tmp_path)
    torch.save({"network": {}}, tmp_path / trainer.CHECKPOINT)
    with pytest.raises(ValueError, match="another release of onemap train: move it away"):
        other.load(tmp_path)
    (tmp_path / trainer.CHECKPOINT).write_bytes(b"half")
    with pytest.raises(ValueError, match="is damaged"):
        trainer.load_averaged_network(tmp_path)


def test_a_training_that_diverges_keeps_its_weights() -> None:
    state = trainer.TrainState(PARAMS, RECORD, CPU)
    before = {name: tensor.clone() for name, tensor in state.network.named_parameters()}
    with pytest.raises(ValueError, match="diverged in step 1, loss nan: try another --seed"):
        state.optimize(loss_of(state, 0) * math.nan)
    for name, tensor in state.network.named_parameters():
        assert torch.equal(tensor, before[name]), name


def train(
    folder: Path, params: batches.TrainParams, *, stop_at: int = 0
) -> tuple[MiniNetwork, list[tuple[int, float]]]:
    """Train; ``stop_at`` interrupts after that step, as Ctrl-C would."""
    reports: list[tuple[int, float]] = []

    def report(step: int, loss: float) -> None:
        reports.append((step, loss))
        if step == stop_at:
            raise KeyboardInterrupt

    bank = batches.build_text_bank(VOCABULARY, embed)
    frames = tiny_frames()
    network = trainer.train_mini(frames, bank, folder, params=params, device=CPU, report=report)
    return network, reports


def weights_of(network: MiniNetwork) -> torch.Tensor:
    return torch.cat([value.flatten().float() for value in network.state_dict().values()])


def test_training_repeats_and_resumes(tmp_path: Path) -> None:
    whole, reports = train(tmp_path / "whole", tiny_params())
    assert [step for step, _ in reports] == [1, 2, 3, 4]
    assert torch.equal(
        weights_of(trainer.load_averaged_network(tmp_path / "whole")[0]), weights_of(whole)
    )
    # Interrupted after step 3: what comes after the checkpoint of step 2 is repeated.
    broken = tmp_path / "broken"
    with pytest.raises(KeyboardInterrupt):
        train(broken, tiny_params(), stop_at=3)
    resumed, rest = train(broken, tiny_params())
    assert [step for step, _ in rest] == [3, 4]
    torch.testing.assert_close(weights_of(resumed), weights_of(whole), rtol=1e-6, atol=1e-7)


@pytest.mark.slow
def test_the_loss_falls(tmp_path: Path) -> None:
    params = tiny_params(steps=20, batch_size=2, weak_share=1.0, full_image_share=0.0)
    _, reports = train(tmp_path, params)
    assert reports[-1][1] < 0.93 * reports[0][1]  # it rises at first
