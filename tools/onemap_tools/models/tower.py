"""The vision tower of a configured encoder as ONNX, for onnxruntime and TensorRT."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch

from onemap_perception.config import EncoderParams, MiniParams, PluginEncoderParams
from onemap_perception.encoders.tipsv2 import DenseTips
from onemap_perception.encoders.torch_encoder import (
    CAMERA_PX,
    ENCODER_KEY,
    INPUT,
    OUTPUT,
    ExportedTower,
    TorchEncoder,
    TorchTower,
)
from onemap_perception.factory import make_encoder
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.models.known import model_errors
from onemap_tools.models.onnx_file import MIN_COSINE, export_module, least_cosine

COMPARED_IMAGES = 2  # of noise, compared patch by patch


def export_encoder(
    config: EncoderParams, path: Path, camera_px: tuple[int, int] = CAMERA_PX
) -> dict[str, Any]:
    """Write the tower for the camera's image size and compare it with torch; a JSON object.

    Single precision, on the CPU: the target machine chooses its own. input_px and cells are
    (width, height). Raises CliError if the encoder cannot be exported or the file disagrees; no
    file is left then.
    """
    if isinstance(config, MiniParams):
        raise CliError(
            f"The encoder {config.backend} runs in onnxruntime already.", EXIT_USAGE_ERROR
        )
    if isinstance(config, PluginEncoderParams):
        raise CliError("Only the package of this encoder can export it.", EXIT_USAGE_ERROR)
    plain = config.model_copy(update={"device": "cpu", "exported": None, "channels": 0})
    with model_errors():
        encoder = make_encoder(plain)
    assert isinstance(encoder, TorchEncoder)
    tower = encoder.tower
    assert isinstance(tower, TorchTower)
    width, height = camera_px
    noise = np.random.default_rng(0).integers(0, 256, (COMPARED_IMAGES, height, width, 3))
    images = [encoder.prepare(rgb) for rgb in noise.astype(np.uint8)]
    path.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(tower.module, DenseTips):
        tower.module.fix_size(images[0].shape[3], images[0].shape[2])
    model = export_module(tower.module, torch.from_numpy(images[0]), path, names=(INPUT, OUTPUT))
    onnx.helper.set_model_props(model, {ENCODER_KEY: encoder.encoder_id})
    onnx.save(model, str(path))
    exported = ExportedTower(path, "cpu", encoder.encoder_id)
    cosines = [least_cosine(exported(image), tower(image)) for image in images]
    least = min(cosines)
    if not least > MIN_COSINE:
        path.unlink()
        raise CliError(f"The export disagrees with torch: cosine {least:.5f}, not {MIN_COSINE}")
    rows, columns = exported(images[0]).shape[:2]
    return {
        "path": str(path),
        "encoder_id": encoder.encoder_id,
        "input_px": (images[0].shape[3], images[0].shape[2]),
        "cells": (columns, rows),
        "least_cosine": least,
        "trtexec": f"trtexec --onnx={path} --fp16 --saveEngine={path.with_suffix('.engine')}",
    }
