"""The files of the encoder ``mini``: ONNX weights and the embedding table of its words."""

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
from onemap_perception.text.embeddings import EmbedTexts
from onemap_perception.text.vocabulary import TABLE_FILE, Vocabulary
from onemap_shared.geometry import U8
from onemap_tools.train.network import MiniNetwork

OPSET = 17  # the first with LayerNormalization; taken apart, it overflows in fp16
MIN_COSINE = 0.999  # of every patch, between torch and the file
MIN_HALF_SIZE = 256  # weights with fewer numbers stay in single precision


class _ImageToFeatures(nn.Module):
    """The network from a camera's image to the features of a field."""

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
    with warnings.catch_warnings():
        # The successor of this exporter needs a package that nothing else here needs.
        warnings.simplefilter("ignore")
        torch.onnx.export(
            _ImageToFeatures(network).eval(),
            (torch.zeros(240, 320, 3, dtype=torch.uint8),),
            str(path),
            opset_version=OPSET,
            input_names=["rgb"],
            output_names=["features"],
            dynamic_axes={"rgb": {0: "H", 1: "W"}, "features": {0: "h", 1: "w"}},
            dynamo=False,
        )
    model = onnx.load(str(path))
    store_weights_as_half(model)
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, str(path))
    return path


def compare_with_torch(network: MiniNetwork, path: Path, images: U8) -> float:
    """The lowest cosine of any patch between torch and the file, over images (N, H, W, 3)."""
    session = open_session(path, threads=1)
    module = _ImageToFeatures(network).eval()
    cosines = []
    for rgb in images:
        exported = session.run(None, {"rgb": rgb})[0]
        with torch.inference_mode():
            expected = module(torch.from_numpy(rgb.copy())).numpy()
        cosines.append(_least_cosine(exported, expected))
    return float(np.min(cosines))  # NaN if one is


def _least_cosine(a: np.ndarray, b: np.ndarray) -> float:
    """The lowest cosine between features (h, w, D) of the same patch."""
    first, second = a.astype(np.float64), b.astype(np.float64)
    norms = np.linalg.norm(first, axis=-1) * np.linalg.norm(second, axis=-1)
    return float(((first * second).sum(axis=-1) / norms).min())


def write_embedding_table(vocabulary: Vocabulary, embed: EmbedTexts, folder: Path) -> Path:
    """Write ``words.npz`` with the embedding of every word of the vocabulary."""
    words = vocabulary.words
    rows = embed([vocabulary.prompt.format(word) for word in words]).astype(np.float16)
    path = folder / TABLE_FILE
    np.savez_compressed(path, words=np.array(words), embeddings=rows)
    return path


def store_weights_as_half(model: onnx.ModelProto) -> None:
    """Store large float32 weights as float16 and cast them back when the file is loaded."""
    graph = model.graph
    casts = []
    for weight in graph.initializer:
        if weight.data_type != TensorProto.FLOAT or np.prod(weight.dims) < MIN_HALF_SIZE:
            continue
        name = weight.name
        half = numpy_helper.from_array(numpy_helper.to_array(weight).astype(np.float16))
        half.name = f"{name}.half"
        weight.CopyFrom(half)
        casts.append(helper.make_node("Cast", [half.name], [name], to=TensorProto.FLOAT))
    rest = list(graph.node)
    del graph.node[:]
    graph.node.extend([*casts, *rest])
