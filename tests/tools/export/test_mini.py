"""The exported network of ``mini`` and the embedding table of its words."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import torch

from onemap_perception.onnx import open_session
from onemap_tools.export.mini import compare_with_torch, export_network, write_embedding_table
from onemap_tools.train.network.mini_network import MiniNetwork
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


def test_the_mirrored_image_has_nearly_the_mirrored_features(tmp_path: Path) -> None:
    """Two views are averaged, and each is the other's mirror image but for their size."""
    torch.manual_seed(0)
    session = open_session(export_network(MiniNetwork().eval(), tmp_path), threads=1)
    smooth = cv2.resize(IMAGES[0], (160, 128), interpolation=cv2.INTER_CUBIC)

    def features(rgb: np.ndarray) -> np.ndarray:
        result: np.ndarray = session.run(None, {"rgb": np.ascontiguousarray(rgb)})[0]
        return result.astype(np.float32)

    own, mirrored = features(smooth), features(smooth[:, ::-1])[:, ::-1]
    assert own.shape == (16, 20, 384)
    np.testing.assert_allclose(np.linalg.norm(own, axis=2), 1, atol=2e-3)
    assert (own * mirrored).sum(axis=2).mean() > 0.9


def test_the_embedding_table_holds_every_word(tmp_path: Path) -> None:
    path = write_embedding_table(VOCABULARY, embed, tmp_path)
    with np.load(path, allow_pickle=False) as table:
        assert table["words"].tolist() == list(VOCABULARY.words)
        expected = embed([f"a {word}" for word in VOCABULARY.words])
        np.testing.assert_allclose(table["embeddings"].astype(np.float32), expected, atol=1e-3)
