"""Write a torch module as ONNX, and compare what the file computes with torch."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import onnx
import torch
from torch import Tensor

OPSET = 17  # the first with LayerNormalization; taken apart, it overflows in fp16
MIN_COSINE = 0.999  # of every patch, between torch and the file


def export_module(
    module: torch.nn.Module,
    example: Tensor,
    path: Path,
    *,
    names: tuple[str, str],
    dynamic_axes: Mapping[str, Mapping[int, str]] | None = None,
) -> onnx.ModelProto:
    """Trace the module with an example input, write the file and return its content.

    ``names``: of the input and the output.
    """
    with warnings.catch_warnings():
        # The successor of this exporter needs a package that nothing else here needs.
        warnings.simplefilter("ignore")
        torch.onnx.export(
            module,
            (example,),
            str(path),
            opset_version=OPSET,
            input_names=[names[0]],
            output_names=[names[1]],
            dynamic_axes=dynamic_axes,
            dynamo=False,
        )
    return onnx.load(str(path))


def least_cosine(a: np.ndarray, b: np.ndarray) -> float:
    """The lowest cosine between features (h, w, D) of the same patch."""
    first, second = a.astype(np.float64), b.astype(np.float64)
    norms = np.linalg.norm(first, axis=-1) * np.linalg.norm(second, axis=-1)
    return float(((first * second).sum(axis=-1) / norms).min())
