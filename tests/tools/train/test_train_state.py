"""Schedule, averaged weights and checkpoint of a training."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file, save_file

from onemap_tools.train.train_state import (
    CHECKPOINT,
    TrainState,
    average_tensor,
    learning_rate_factor,
    load_averaged_network,
)
from tests.tools.train.tiny import tiny_params

CPU = torch.device("cpu")
PARAMS = tiny_params(steps=100, warmup_steps=10, full_image_share=0.2)


def loss_of(state: TrainState, step: int) -> torch.Tensor:
    """Some loss that depends on all weights."""
    generator = torch.Generator().manual_seed(step)
    rgb = torch.rand(2, 3, 32, 32, generator=generator) * 255
    return state.network.forward_features(rgb).square().mean()


def advance(state: TrainState, steps: int) -> None:
    """Optimize that many times."""
    state.network.train()
    for _ in range(steps):
        state.optimize(loss_of(state, state.step))


def test_the_learning_rate_warms_up_and_falls_twice() -> None:
    factors = [learning_rate_factor(step, PARAMS) for step in range(PARAMS.total_steps)]
    assert factors[:10] == pytest.approx([0.1 * (i + 1) for i in range(10)])
    assert factors[10] == 1
    assert factors[55] == pytest.approx(0.5)
    peak = PARAMS.full_image_learning_rate / PARAMS.learning_rate
    assert factors[100] == pytest.approx(peak)
    assert factors[110] == pytest.approx(peak / 2)
    assert factors[119] == pytest.approx(peak * 0.5 * (1 + math.cos(math.pi * 0.95)))
    assert max(factors) == 1


def test_the_optimizer_follows_the_schedule_also_after_loading(tmp_path: Path) -> None:
    state = TrainState(PARAMS, CPU)
    advance(state, 3)
    state.save(tmp_path)
    resumed = TrainState(PARAMS, CPU)
    resumed.load(tmp_path)
    factor = learning_rate_factor(3, PARAMS)
    for each in (state, resumed):
        assert each.step == 3
        pyramid, backbone = (each._optimizer.param_groups[i]["lr"] for i in (0, 2))
        assert pyramid == pytest.approx(PARAMS.learning_rate * factor)
        assert backbone == pytest.approx(pyramid * PARAMS.backbone_lr_scale)


def test_the_average_is_a_moving_one_whose_decay_grows() -> None:
    average, slow = torch.zeros(1), 0.0
    for count in range(1, 30):
        value = torch.tensor([float(count)])
        average = average_tensor(0.6, average, value, torch.tensor(count))
        decay = min(0.6, (1 + count) / (10 + count))
        slow = decay * slow + (1 - decay) * count
        assert average.item() == pytest.approx(slow, rel=1e-5)
    counter = average_tensor(0.6, torch.tensor(3), torch.tensor(7), torch.tensor(5))
    assert counter.item() == 7


def test_the_averaged_network_lags_behind_with_its_statistics() -> None:
    state = TrainState(tiny_params(learning_rate=0.1), CPU)
    name = "head.weight"
    before = state.network.state_dict()[name].clone()
    advance(state, 1)
    now = state.network.state_dict()[name]
    expected = before.lerp(now, 1 - 2 / 11)
    torch.testing.assert_close(state.averaged_network.state_dict()[name], expected)
    statistic = "coarse.0.body.1.running_mean"
    moved = state.network.state_dict()[statistic]
    torch.testing.assert_close(state.averaged_network.state_dict()[statistic], moved * (1 - 2 / 11))


def test_a_loaded_state_goes_on_as_if_never_interrupted(tmp_path: Path) -> None:
    whole = TrainState(PARAMS, CPU)
    advance(whole, 2)
    whole.save(tmp_path)
    resumed = TrainState(PARAMS, CPU)
    resumed.load(tmp_path)
    advance(whole, 2)
    advance(resumed, 2)
    for one, other in (
        (whole.network, resumed.network),
        (whole.averaged_network, resumed.averaged_network),
    ):
        for name, tensor in one.state_dict().items():
            torch.testing.assert_close(tensor, other.state_dict()[name], rtol=1e-6, atol=1e-7)


def test_the_checkpoint_s_average_is_loaded_alone(tmp_path: Path) -> None:
    state = TrainState(PARAMS, CPU)
    advance(state, 1)
    state.save(tmp_path)
    loaded = load_averaged_network(tmp_path)
    assert not loaded.training
    for name, tensor in state.averaged_network.state_dict().items():
        assert torch.equal(loaded.state_dict()[name], tensor), name


def test_a_checkpoint_of_another_release_is_refused(tmp_path: Path) -> None:
    state = TrainState(PARAMS, CPU)
    state.save(tmp_path)
    tensors = load_file(tmp_path / CHECKPOINT)
    save_file(tensors, tmp_path / CHECKPOINT, metadata={"step": "1", "steps": "2"})
    with pytest.raises(ValueError, match="another release of onemap train: remove it"):
        state.load(tmp_path)
    with pytest.raises(ValueError, match="another release"):
        load_averaged_network(tmp_path)


@pytest.mark.parametrize("written", ["2", "3", "4"])
def test_weights_of_an_earlier_release_start_a_training(tmp_path: Path, written: str) -> None:
    state = TrainState(PARAMS, CPU)
    state.save(tmp_path)
    tensors = load_file(tmp_path / CHECKPOINT)
    save_file(tensors, tmp_path / CHECKPOINT, metadata={"format": written, "step": "1"})
    with pytest.raises(ValueError, match="another release"):
        state.load(tmp_path)
    started = TrainState(tiny_params(seed=1, start_from=tmp_path), CPU)
    for name, tensor in started.network.state_dict().items():
        assert torch.equal(tensor, state.averaged_network.state_dict()[name]), name


def test_a_folder_without_a_checkpoint_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="holds no checkpoint: make one with"):
        load_averaged_network(tmp_path)
