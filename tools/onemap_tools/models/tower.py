"""The vision tower of a configured encoder as ONNX, for onnxruntime and TensorRT."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch

from onemap_perception.encoders.mini import MiniParams
from onemap_perception.encoders.params import EncoderParams, RadioParams, TorchParams
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
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_shared.geometry import F32
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.export.onnx_file import MIN_COSINE, export_module, least_cosine

COMPARED_IMAGES = 2  # of noise, compared patch by patch


@dataclass(frozen=True, slots=True)
class ExportResult:
    """The file and its agreement with torch; input_px and cells are (width, height)."""

    path: str
    encoder_id: str
    input_px: tuple[int, int]
    cells: tuple[int, int]
    least_cosine: float
    trtexec: str

    def document(self) -> dict[str, Any]:
        """The result as a JSON object."""
        return asdict(self)


def export_encoder(
    config: EncoderParams, path: Path, camera_px: tuple[int, int] = CAMERA_PX
) -> ExportResult:
    """Write the tower for the camera's image size and compare it with torch.

    Single precision, on the CPU: the target machine chooses its own. Raises CliError if the
    encoder cannot be exported or the file disagrees; no file is left then.
    """
    if isinstance(config, MiniParams):
        raise CliError("The encoder mini is an ONNX file already: mini/mini.onnx", EXIT_USAGE_ERROR)
    if isinstance(config, RadioParams):
        raise CliError(
            "RADIO runs code from its model folder, which OneMap cannot export", EXIT_USAGE_ERROR
        )
    encoder = _make_cpu_encoder(config)
    tower = encoder.tower
    assert isinstance(tower, TorchTower)
    width, height = camera_px
    noise = np.random.default_rng(0).integers(0, 256, (COMPARED_IMAGES, height, width, 3))
    images = [encoder.prepare(rgb) for rgb in noise.astype(np.uint8)]
    path.parent.mkdir(parents=True, exist_ok=True)
    _export_onnx(tower.module, images[0], path, encoder.encoder_id)
    exported = ExportedTower(path, "cpu", encoder.encoder_id)
    cosines = [least_cosine(exported(image), tower(image)) for image in images]
    least = min(cosines)
    if not least > MIN_COSINE:
        path.unlink()
        raise CliError(f"The export disagrees with torch: cosine {least:.5f}, not {MIN_COSINE}")
    rows, columns = exported(images[0]).shape[:2]
    return ExportResult(
        path=str(path),
        encoder_id=encoder.encoder_id,
        input_px=(images[0].shape[3], images[0].shape[2]),
        cells=(columns, rows),
        least_cosine=least,
        trtexec=f"trtexec --onnx={path} --fp16 --saveEngine={path.with_suffix('.engine')}",
    )


def _make_cpu_encoder(config: TorchParams) -> TorchEncoder:
    of_tower = {"device": "cpu", "exported": None, "channels": 0}
    plain = config.model_copy(update=of_tower)
    try:
        encoder = make_encoder(plain)
    except BackendError as problem:
        raise CliError(str(problem)) from problem
    assert isinstance(encoder, TorchEncoder)
    return encoder


def _export_onnx(module: torch.nn.Module, image: F32, path: Path, encoder_id: str) -> None:
    if isinstance(module, DenseTips):
        module.fix_size(image.shape[3], image.shape[2])
    model = export_module(module, torch.from_numpy(image), path, names=(INPUT, OUTPUT))
    onnx.helper.set_model_props(model, {ENCODER_KEY: encoder_id})
    onnx.save(model, str(path))
