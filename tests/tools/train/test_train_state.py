"""Schedule, averaged weights and checkpoint of a training."""

from __future__ import annotations

import hashlib
import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file, save_file

from onemap_tools.train.network.mini_network import MiniNetwork
from onemap_tools.train.rounds import TrainingRound
from onemap_tools.train.train_state import (
    CHECKPOINT,
    TrainState,
    average_tensor,
    learning_rate_factor,
    load_averaged_network,
    read_checkpoint_rounds,
)
from tests.tools.train.tiny import tiny_params

CPU = torch.device("cpu")
PARAMS = tiny_params(steps=100, warmup_steps=10, full_image_share=0.2)
NAMES = (358, "ca7546b2b8fe")  # number of the network's tensors and the digest of their names
ROUND = TrainingRound(steps=100, seed=0, pictures=6, apartments=1, frozen_stride=0)


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
    state = TrainState(PARAMS, ROUND, CPU)
    advance(state, 3)
    state.save(tmp_path)
    resumed = TrainState(PARAMS, ROUND, CPU)
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
    state = TrainState(tiny_params(learning_rate=0.1), ROUND, CPU)
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
    whole = TrainState(PARAMS, ROUND, CPU)
    advance(whole, 2)
    whole.save(tmp_path)
    resumed = TrainState(PARAMS, ROUND, CPU)
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
    state = TrainState(PARAMS, ROUND, CPU)
    advance(state, 1)
    state.save(tmp_path)
    loaded = load_averaged_network(tmp_path)
    assert not loaded.training
    for name, tensor in state.averaged_network.state_dict().items():
        assert torch.equal(loaded.state_dict()[name], tensor), name


def test_a_checkpoint_of_another_release_is_refused(tmp_path: Path) -> None:
    state = TrainState(PARAMS, ROUND, CPU)
    state.save(tmp_path)
    tensors = load_file(tmp_path / CHECKPOINT)
    save_file(tensors, tmp_path / CHECKPOINT, metadata={"step": "1", "steps": "2"})
    with pytest.raises(ValueError, match="another release of onemap train: move it away"):
        state.load(tmp_path)
    with pytest.raises(ValueError, match="another release"):
        load_averaged_network(tmp_path)


@pytest.mark.parametrize("written", ["2", "3", "4", "5"])
def test_weights_of_an_earlier_release_start_a_training(tmp_path: Path, written: str) -> None:
    state = TrainState(PARAMS, ROUND, CPU)
    state.save(tmp_path)
    tensors = load_file(tmp_path / CHECKPOINT)
    save_file(tensors, tmp_path / CHECKPOINT, metadata={"format": written, "step": "1"})
    with pytest.raises(ValueError, match="another release"):
        state.load(tmp_path)
    params = tiny_params(seed=1, start_from=tmp_path)
    started = TrainState(params, ROUND, CPU)
    for name, tensor in started.network.state_dict().items():
        assert torch.equal(tensor, state.averaged_network.state_dict()[name]), name
    assert started.rounds == (ROUND,)  # what was before is not known


def test_names_of_the_tensors_are_those_of_earlier_releases() -> None:
    """Another name would make every checkpoint unreadable: raise the format then."""
    names = list(MiniNetwork().state_dict())
    digest = hashlib.sha256("\n".join(names).encode()).hexdigest()
    assert (len(names), digest[:12]) == NAMES


def test_the_rounds_before_are_kept(tmp_path: Path) -> None:
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
    TrainState(PARAMS, ROUND, CPU).save(tmp_path / "first")
    again = replace(ROUND, seed=1)
    params = tiny_params(seed=1, start_from=tmp_path / "first")
    TrainState(params, again, CPU).save(tmp_path / "second")
    assert read_checkpoint_rounds(tmp_path / "second") == (ROUND, again)
    # The first is not needed any more to go on.
    (tmp_path / "first" / CHECKPOINT).unlink()
    resumed = TrainState(params, again, CPU, resumed=True)
    resumed.load(tmp_path / "second")
    assert resumed.rounds == (ROUND, again)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"steps": 7}, "steps 100 rather than 7"),
        ({"seed": 3}, "seed 0 rather than 3"),
        ({"pictures": 12}, "pictures 6 rather than 12"),
    ],
)
def test_a_training_with_other_options_is_not_gone_on_with(
    tmp_path: Path, change: dict[str, int], named: str
) -> None:
    TrainState(PARAMS, ROUND, CPU).save(tmp_path)
    other = TrainState(PARAMS, replace(ROUND, **change), CPU, resumed=True)
    with pytest.raises(ValueError, match=f"{named}: repeat its options, or choose another --work"):
        other.load(tmp_path)


def test_a_training_begun_anew_is_not_gone_on_with_as_one_of_two_rounds(tmp_path: Path) -> None:
    TrainState(PARAMS, ROUND, CPU).save(tmp_path)
    params = PARAMS.model_copy(update={"start_from": tmp_path})
    with pytest.raises(
        ValueError, match="weights begun anew rather than of another training: repeat"
    ):
        TrainState(params, ROUND, CPU, resumed=True).load(tmp_path)


def test_a_damaged_checkpoint_is_named(tmp_path: Path) -> None:
    (tmp_path / CHECKPOINT).write_bytes(b"half")
    with pytest.raises(ValueError, match="is damaged"):
        load_averaged_network(tmp_path)


def test_a_training_that_diverges_keeps_its_weights() -> None:
    state = TrainState(PARAMS, ROUND, CPU)
    before = {name: tensor.clone() for name, tensor in state.network.named_parameters()}
    with pytest.raises(ValueError, match="diverged in step 1, loss nan: try another --seed"):
        state.optimize(loss_of(state, 0) * math.nan)
    for name, tensor in state.network.named_parameters():
        assert torch.equal(tensor, before[name]), name


def test_a_folder_without_a_checkpoint_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="holds no checkpoint: make one with"):
        load_averaged_network(tmp_path)
