"""Features of length one at stride 8, with the context of the whole image."""

from __future__ import annotations

import torch

from onemap_tools.train.network.mini_network import FEATURE_DIM, MiniNetwork


def test_features_have_stride_8_and_length_one() -> None:
    torch.manual_seed(0)
    features = MiniNetwork().eval()(torch.rand(2, 3, 40, 72) * 255)
    assert features.shape == (2, FEATURE_DIM, 5, 9)
    torch.testing.assert_close(features.norm(dim=1), torch.ones(2, 5, 9))


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
