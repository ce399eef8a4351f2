"""Network, loss, schedule, checkpoint and loop: the training repeats itself, resumes and learns."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from onemap_tools.train import batches, trainer
from onemap_tools.train.frames import NO_CLASS
from onemap_tools.train.network import (
    FROZEN_STAGES,
    EfficientNetLite0,
    MiniNetwork,
    load_backbone_weights,
)
from tests.tools.train.tiny import VOCABULARY, embed, published, tiny_frames, tiny_params

CPU = torch.device("cpu")
PARAMS = tiny_params(steps=100, warmup_steps=10, full_image_share=0.2)
RECORD = trainer.TrainingRecord(steps=100, seed=0, pictures=6, apartments=1)
FROZEN = ("stem.", *(f"stages.{index}." for index in range(FROZEN_STAGES)))


def with_random_statistics(network: torch.nn.Module) -> None:
    """Batch-norm weights and statistics that are not 0 and 1."""
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            for tensor in (module.weight.data, module.running_var):
                assert tensor is not None
                tensor.uniform_(0.5, 1.5)
            assert module.running_mean is not None
            module.running_mean.uniform_(-0.5, 0.5)


def test_it_is_the_network_that_timm_has() -> None:
    timm = pytest.importorskip("timm", reason="needs timm (requirements/encoders.txt)")
    torch.manual_seed(0)
    own = EfficientNetLite0()
    with_random_statistics(own)
    reference = timm.create_model(
        "efficientnet_lite0", features_only=True, out_indices=(1, 2, 3, 4), bn_eps=1e-3
    )
    tensors = own.state_dict().values()
    reference.load_state_dict(dict(zip(reference.state_dict(), tensors, strict=True)))
    image = torch.rand(2, 3, 72, 104) * 2 - 1
    with torch.inference_mode():
        pairs = list(zip(own.eval()(image), reference.eval()(image), strict=True))
    for mine, expected in pairs:
        assert expected.std() > 0
        torch.testing.assert_close(mine, expected, rtol=1e-5, atol=1e-5)


def test_weights_of_another_network_are_refused(tmp_path: Path) -> None:
    torch.save({"_conv_stem.weight": torch.zeros(3)}, tmp_path / "other.pth")
    with pytest.raises(ValueError, match="does not hold the backbone"):
        load_backbone_weights(EfficientNetLite0(), tmp_path / "other.pth")


def test_a_patch_depends_on_the_opposite_end_of_the_image() -> None:
    torch.manual_seed(0)
    network = MiniNetwork()
    first = torch.rand(1, 3, 64, 256) * 255
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            module.momentum = 1.0
    network(first)  # the statistics become those of this image
    network.eval()
    second = first.clone()
    second[..., 192:] = 0
    with torch.inference_mode():
        change = network.forward_features(first) - network.forward_features(second)
    assert change[..., 0].abs().max() > 1e-4


def test_patch_targets_are_shares_of_pixels() -> None:
    label = np.zeros((1, 8, 16), np.uint8)
    label[0, :2, :8] = 1
    label[0, :, 12:] = NO_CLASS
    np.testing.assert_allclose(batches.patch_targets(label, 2), [[0.75, 0.25], [0.5, 0.0]])


def test_rare_classes_weigh_more_and_the_mean_is_one() -> None:
    frequency = np.array([0.9, 0.1, 0.0], np.float32)
    weights = batches.class_weights(frequency, 0.5).numpy()
    assert weights[1] / weights[0] == pytest.approx(3)
    assert weights[2] > weights[1]
    assert weights @ frequency == pytest.approx(1, rel=0.02)
    np.testing.assert_allclose(batches.class_weights(frequency, 0.0).numpy(), 1, rtol=1e-6)


def test_the_loss_is_least_at_the_right_text() -> None:
    texts = torch.eye(3, 384)
    targets = torch.tensor([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    weights = torch.ones(2)

    def loss(features: torch.Tensor) -> float:
        return batches.alignment_loss(features, targets, texts, weights).item()

    right, wrong, neutral = texts[[0, 1, 2]], texts[[1, 0, 2]], texts[[2, 2, 2]]
    assert loss(right) == pytest.approx(0, abs=1e-6)
    assert loss(wrong) == pytest.approx(20.5, abs=1e-4)  # 20 nats and a cosine of 0
    assert loss(neutral) == pytest.approx(20.5, abs=1e-4)
    assert loss(5 * right) == pytest.approx(loss(right), abs=1e-6)


def loss_of(state: trainer.TrainState, step: int) -> torch.Tensor:
    """Some loss that depends on all weights."""
    generator = torch.Generator().manual_seed(step)
    rgb = torch.rand(2, 3, 32, 32, generator=generator) * 255
    return state.network.forward_features(rgb).square().mean()


def test_the_learning_rate_warms_up_and_falls_twice() -> None:
    factors = [trainer.learning_rate_factor(step, PARAMS) for step in range(PARAMS.total_steps)]
    assert factors[:10] == pytest.approx([0.1 * (i + 1) for i in range(10)])
    assert factors[10] == 1
    assert factors[55] == pytest.approx(0.5)
    peak = PARAMS.full_image_learning_rate / PARAMS.learning_rate
    assert factors[100] == pytest.approx(peak)
    assert factors[110] == pytest.approx(peak / 2)
    assert factors[119] == pytest.approx(peak * 0.5 * (1 + math.cos(math.pi * 0.95)))
    assert max(factors) == 1


def test_the_average_is_a_moving_one_whose_decay_grows() -> None:
    average, slow = torch.zeros(1), 0.0
    for count in range(1, 30):
        value = torch.tensor([float(count)])
        average = trainer.average_tensor(0.6, average, value, torch.tensor(count))
        decay = min(0.6, (1 + count) / (10 + count))
        slow = decay * slow + (1 - decay) * count
        assert average.item() == pytest.approx(slow, rel=1e-5)
    counter = trainer.average_tensor(0.6, torch.tensor(3), torch.tensor(7), torch.tensor(5))
    assert counter.item() == 7


def test_a_checkpoint_that_does_not_fit_is_not_gone_on_with(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="holds no checkpoint: make one with"):
        trainer.load_averaged_network(tmp_path)
    trainer.TrainState(PARAMS, RECORD, CPU).save(tmp_path)
    other = trainer.TrainState(PARAMS, replace(RECORD, steps=7, pictures=12), CPU)
    with pytest.raises(ValueError, match=r"steps 100 rather than 7, pictures 6 rather than 12: re"):
        other.load(tmp_path)
    tensors = load_file(tmp_path / trainer.CHECKPOINT)
    save_file(tensors, tmp_path / trainer.CHECKPOINT, metadata={"step": "1", "steps": "2"})
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
) -> tuple[MiniNetwork, list[trainer.TrainingProgress]]:
    """Train; ``stop_at`` interrupts after that step, as Ctrl-C would."""
    reports: list[trainer.TrainingProgress] = []

    def report(progress: trainer.TrainingProgress) -> None:
        reports.append(progress)
        if progress.step == stop_at:
            raise KeyboardInterrupt

    bank = batches.build_text_bank(VOCABULARY, embed)
    frames = tiny_frames()
    network = trainer.train_mini(frames, bank, folder, params=params, device=CPU, report=report)
    return network, reports


def weights_of(network: MiniNetwork) -> torch.Tensor:
    return torch.cat([value.flatten().float() for value in network.state_dict().values()])


def test_training_repeats_and_resumes(tmp_path: Path) -> None:
    whole, reports = train(tmp_path / "whole", tiny_params())
    assert [report.step for report in reports] == [1, 2, 3, 4]
    assert torch.equal(
        weights_of(trainer.load_averaged_network(tmp_path / "whole")[0]), weights_of(whole)
    )
    other, _ = train(tmp_path / "other", tiny_params(seed=1))
    assert not torch.allclose(weights_of(other), weights_of(whole), rtol=1e-3, atol=1e-4)
    # Interrupted after step 3: what comes after the checkpoint of step 2 is repeated.
    broken = tmp_path / "broken"
    with pytest.raises(KeyboardInterrupt):
        train(broken, tiny_params(), stop_at=3)
    resumed, rest = train(broken, tiny_params())
    assert [report.step for report in rest] == [3, 4]
    torch.testing.assert_close(weights_of(resumed), weights_of(whole), rtol=1e-6, atol=1e-7)


def test_training_starts_from_the_backbone_and_keeps_its_early_stages(tmp_path: Path) -> None:
    torch.manual_seed(7)
    backbone = EfficientNetLite0()
    file = published(backbone, tmp_path / "weights.pth")
    network, _ = train(tmp_path / "run", tiny_params(learning_rate=0.1, backbone_weights=file))
    source = backbone.state_dict()
    for name, tensor in network.backbone.state_dict().items():
        if name.endswith("num_batches_tracked"):
            continue
        same = torch.allclose(tensor, source[name], rtol=1e-4, atol=1e-6)
        assert same == name.startswith(FROZEN), name


@pytest.mark.slow
def test_the_loss_falls(tmp_path: Path) -> None:
    params = tiny_params(steps=30, batch_size=2, weak_share=1.0, full_image_share=0.0)
    _, reports = train(tmp_path, params)
    assert reports[-1].loss < 0.93 * reports[0].loss  # it rises at first
