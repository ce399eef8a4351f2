"""The exported network of ``mini`` and the embedding table of its words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch

from onemap_tools.export.mini import compare_with_torch, export_network, write_embedding_table
from onemap_tools.train.network import MiniNetwork
from tests.tools.train.tiny import VOCABULARY, embed

IMAGES = np.random.default_rng(0).integers(0, 256, (2, 64, 88, 3), dtype=np.uint8)


def test_what_is_exported_agrees_with_torch_and_is_small(tmp_path: Path) -> None:
    torch.manual_seed(0)
    network = MiniNetwork().eval()
    path = export_network(network, tmp_path)
    assert compare_with_torch(network, path, IMAGES) > 0.999
    assert path.stat().st_size < 12 * 2**20
    other = MiniNetwork().eval()
    assert compare_with_torch(other, path, IMAGES) < 0.9


def test_the_embedding_table_holds_every_word(tmp_path: Path) -> None:
    path = write_embedding_table(VOCABULARY, embed, tmp_path)
    with np.load(path, allow_pickle=False) as table:
        assert table["words"].tolist() == list(VOCABULARY.words)
        expected = embed([f"a {word}" for word in VOCABULARY.words])
        np.testing.assert_allclose(table["embeddings"].astype(np.float32), expected, atol=1e-3)
