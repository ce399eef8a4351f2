"""The vision tower of a configured encoder as ONNX, for onnxruntime and TensorRT."""

from __future__ import annotations

import warnings
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch

from onemap_perception.encoders.exported_tower import ENCODER_KEY, INPUT, OUTPUT, ExportedTower
from onemap_perception.encoders.mini import MiniParams
from onemap_perception.encoders.params import EncoderParams, RadioParams, TorchParams
from onemap_perception.encoders.tipsv2 import DenseTips
from onemap_perception.encoders.torch_encoder import TorchEncoder
from onemap_perception.encoders.torch_tower import TorchTower
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_shared.geometry import F32
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

OPSET = 17  # the first with LayerNormalization; taken apart, it overflows in fp16
MIN_COSINE = 0.999  # of every cell, between torch and the file
COMPARED_IMAGES = 2  # of noise, compared cell by cell


@dataclass(frozen=True, slots=True)
class ExportResult:
    """What was written and how well it agrees; input_px and cells are (width, height)."""

    path: str
    encoder_id: str
    input_px: tuple[int, int]
    cells: tuple[int, int]
    least_cosine: float
    trtexec: str

    def document(self) -> dict[str, Any]:
        """As JSON."""
        return asdict(self)


def export_encoder(config: EncoderParams, path: Path) -> ExportResult:
    """Write the tower for the camera's size and compare; raises CliError, and leaves no file then.

    Single precision, on the CPU: the target machine chooses its own.
    """
    if isinstance(config, MiniParams):
        raise CliError("The encoder mini is an ONNX file already: mini/mini.onnx", EXIT_USAGE_ERROR)
    if isinstance(config, RadioParams):
        raise CliError("Code of other people's cannot be exported by OneMap", EXIT_USAGE_ERROR)
    encoder = _make_cpu_encoder(config)
    tower = encoder.tower
    assert isinstance(tower, TorchTower)
    width, height = config.warm_up_px
    noise = np.random.default_rng(0).integers(0, 256, (COMPARED_IMAGES, height, width, 3))
    pictures = [encoder.prepare(rgb) for rgb in noise.astype(np.uint8)]
    path.parent.mkdir(parents=True, exist_ok=True)
    _export_onnx(tower.module, pictures[0], path, encoder.encoder_id)
    exported = ExportedTower(path, "cpu", encoder.encoder_id)
    cosines = [cosine(exported(picture), tower(picture)) for picture in pictures]
    least = min(cosines)
    if not least > MIN_COSINE:
        path.unlink()
        raise CliError(f"The export disagrees with torch: cosine {least:.5f}, not {MIN_COSINE}")
    rows, columns = exported(pictures[0]).shape[:2]
    return ExportResult(
        path=str(path),
        encoder_id=encoder.encoder_id,
        input_px=(pictures[0].shape[3], pictures[0].shape[2]),
        cells=(columns, rows),
        least_cosine=least,
        trtexec=f"trtexec --onnx={path} --fp16 --saveEngine={path.with_suffix('.engine')}",
    )


def cosine(a: np.ndarray, b: np.ndarray) -> float:
    """The lowest of all cells (h, w, D)."""
    first, second = a.astype(np.float64), b.astype(np.float64)
    norms = np.linalg.norm(first, axis=-1) * np.linalg.norm(second, axis=-1)
    return float(((first * second).sum(axis=-1) / norms).min())


def _make_cpu_encoder(config: TorchParams) -> TorchEncoder:
    plain = config.model_copy(update={"device": "cpu", "compiled": False, "exported": None})
    try:
        encoder = make_encoder(plain)
    except BackendError as problem:
        raise CliError(str(problem)) from problem
    assert isinstance(encoder, TorchEncoder)
    return encoder


def _export_onnx(module: torch.nn.Module, picture: F32, path: Path, encoder_id: str) -> None:
    if isinstance(module, DenseTips):
        module.fix_size(picture.shape[3], picture.shape[2])
    with warnings.catch_warnings():
        # The successor of this exporter needs a package that nothing else here needs.
        warnings.simplefilter("ignore")
        torch.onnx.export(
            module,
            (torch.from_numpy(picture),),
            str(path),
            opset_version=OPSET,
            input_names=[INPUT],
            output_names=[OUTPUT],
            dynamo=False,
        )
    model = onnx.load(str(path))
    onnx.helper.set_model_props(model, {ENCODER_KEY: encoder_id})
    onnx.save(model, str(path))
