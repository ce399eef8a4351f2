"""EfficientNet-Lite0: equal to timm's, its weights and its frozen stages."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from onemap_tools.train.network.backbone import (
    WIDTHS,
    EfficientNetLite0,
    fix_statistics,
    load_backbone_weights,
)

FROZEN = ("stem.", "stages.0.", "stages.1.0.")  # what computes at stride 2


def published(backbone: EfficientNetLite0, path: Path) -> Path:
    """A checkpoint as the weight package has it: other names, same order, and a classifier."""
    tensors = {f"_blocks.{i}": t for i, t in enumerate(backbone.state_dict().values())}
    rest = {"_conv_head.weight": torch.zeros(8), "_bn1.bias": torch.zeros(8)}
    torch.save({**tensors, **rest, "_fc.weight": torch.zeros(8)}, path)
    return path


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
    timm = pytest.importorskip("timm", reason="needs timm (requirements-encoders.txt)")
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


def test_published_weights_are_loaded_in_order(tmp_path: Path) -> None:
    torch.manual_seed(7)
    source, target = EfficientNetLite0(), EfficientNetLite0()
    load_backbone_weights(target, published(source, tmp_path / "weights.pth"))
    for name, tensor in target.state_dict().items():
        assert torch.equal(tensor, source.state_dict()[name]), name


def test_weights_of_another_network_are_refused(tmp_path: Path) -> None:
    torch.save({"_conv_stem.weight": torch.zeros(3)}, tmp_path / "other.pth")
    with pytest.raises(ValueError, match="does not hold the backbone"):
        load_backbone_weights(EfficientNetLite0(), tmp_path / "other.pth")


def test_sizes_are_rounded_up() -> None:
    levels = EfficientNetLite0().eval()(torch.zeros(1, 3, 120, 72))
    assert [tuple(level.shape[2:]) for level in levels] == [(30, 18), (15, 9), (8, 5), (4, 3)]
    assert tuple(level.shape[1] for level in levels) == WIDTHS


def test_frozen_stages_keep_weights_and_statistics_in_training_mode() -> None:
    backbone = EfficientNetLite0()
    backbone.freeze_first()
    backbone.train()
    before = {name: tensor.clone() for name, tensor in backbone.state_dict().items()}
    backbone(torch.rand(2, 3, 32, 32))[-1].sum().backward()
    for name, tensor in backbone.state_dict().items():
        if name.endswith("running_mean"):
            assert torch.equal(tensor, before[name]) == name.startswith(FROZEN), name
    for name, parameter in backbone.named_parameters():
        assert (parameter.grad is None) == name.startswith(FROZEN), name


def test_fixed_statistics_stay_and_compute_the_same() -> None:
    torch.manual_seed(0)
    backbone = EfficientNetLite0()
    with_random_statistics(backbone)
    image = torch.rand(2, 3, 40, 56) * 2 - 1
    expected = [level.detach() for level in backbone.eval()(image)]
    fix_statistics(backbone)
    backbone.train()
    statistics = {n: t.clone() for n, t in backbone.named_buffers()}
    levels = backbone(image)
    for mine, level in zip(levels, expected, strict=True):
        torch.testing.assert_close(mine, level, rtol=1e-3, atol=1e-3)
    levels[-1].sum().backward()
    assert all(p.grad is not None for p in backbone.parameters()), "weights and norms learn"
    for name, tensor in backbone.named_buffers():
        assert torch.equal(tensor, statistics[name]), name
