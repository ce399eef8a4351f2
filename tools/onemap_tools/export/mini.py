"""From the trained network to the files that ship: ONNX weights, word table, calibration."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import Tensor, nn

from onemap_perception.encoders.mini import NETWORK_FILE
from onemap_perception.onnx import open_session
from onemap_perception.text.embedding_table import TABLE_FILE
from onemap_perception.text.vocabulary import Vocabulary
from onemap_shared.geometry import U8
from onemap_tools.train.data.text_targets import TextEmbedder
from onemap_tools.train.network.mini_network import MiniNetwork

OPSET = 17
MIN_COSINE = 0.999  # between torch and what ships, per patch
HALF_FROM = 256  # weights with more numbers than this are stored in half precision


class _ImageToFeatures(nn.Module):
    """The network between what a camera gives and what a feature field holds."""

    def __init__(self, network: MiniNetwork) -> None:
        super().__init__()
        self.network = network

    def forward(self, rgb: Tensor) -> Tensor:
        """(H, W, 3) uint8 to (h, w, D) float16 unit rows."""
        features: Tensor = self.network(rgb.permute(2, 0, 1)[None].float())
        return features[0].permute(1, 2, 0).half()


def export_network(network: MiniNetwork, folder: Path) -> Path:
    """Write ``mini.onnx``: input rgb (H, W, 3) uint8, output features (h, w, D) float16.

    Batch norms are folded into the convolutions and weights stored in half precision; the
    arithmetic is float32.
    """
    path = folder / NETWORK_FILE
    example = torch.zeros(240, 320, 3, dtype=torch.uint8)
    with warnings.catch_warnings():
        # The successor of this exporter needs a package that nothing else here needs.
        warnings.simplefilter("ignore", DeprecationWarning)
        torch.onnx.export(
            _ImageToFeatures(network).eval(),
            (example,),
            str(path),
            opset_version=OPSET,
            input_names=["rgb"],
            output_names=["features"],
            dynamic_axes={"rgb": {0: "H", 1: "W"}, "features": {0: "h", 1: "w"}},
            dynamo=False,
        )
    model = onnx.load(str(path))
    _store_weights_as_half(model)
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, str(path))
    return path


def least_cosine(network: MiniNetwork, path: Path, pictures: U8) -> float:
    """The lowest cosine of any patch between torch and the exported file; pictures (N, H, W, 3)."""
    session = open_session(path, threads=1)
    camera = _ImageToFeatures(network).eval()
    lowest = 1.0
    for picture in pictures:
        exported = session.run(None, {"rgb": picture})[0].astype(np.float32)
        with torch.inference_mode():
            wanted = camera(torch.from_numpy(picture.copy())).float().numpy()
        norms = np.linalg.norm(exported, axis=-1) * np.linalg.norm(wanted, axis=-1)
        lowest = min(lowest, float(((exported * wanted).sum(axis=-1) / norms).min()))
    return lowest


def write_embedding_table(vocabulary: Vocabulary, embed: TextEmbedder, folder: Path) -> Path:
    """Write ``words.npz`` with the embedding of every word of the vocabulary."""
    words = vocabulary.words
    rows = embed([vocabulary.prompt.format(word) for word in words]).astype(np.float16)
    path = folder / TABLE_FILE
    np.savez_compressed(path, words=np.array(words), embeddings=rows)
    return path


def _store_weights_as_half(model: onnx.ModelProto) -> None:
    """Store large float32 weights as float16 and cast them back when the file is loaded."""
    graph = model.graph
    casts = []
    for weight in graph.initializer:
        if weight.data_type != TensorProto.FLOAT or np.prod(weight.dims) < HALF_FROM:
            continue
        name = weight.name
        half = numpy_helper.from_array(numpy_helper.to_array(weight).astype(np.float16))
        half.name = f"{name}.half"
        weight.CopyFrom(half)
        casts.append(helper.make_node("Cast", [half.name], [name], to=TensorProto.FLOAT))
    rest = list(graph.node)
    del graph.node[:]
    graph.node.extend([*casts, *rest])
