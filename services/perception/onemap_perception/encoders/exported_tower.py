"""A vision tower that was exported to ONNX, run by onnxruntime."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from onemap_perception.encoders.protocol import EncoderError
from onemap_perception.onnx import open_session
from onemap_shared.geometry import F16, F32

ENCODER_KEY = "onemap_encoder_id"  # in the file's metadata: the encoder of the tower
INPUT, OUTPUT = "picture", "features"  # names in files that users have exported


class ExportedTower:
    """Implements ``Tower``: images of the one size that the file was exported for."""

    def __init__(self, path: Path, provider: str, encoder_id: str) -> None:
        self._path = path
        if not path.is_file():
            raise EncoderError(f"{path} does not exist: onemap export-encoder {path}")
        try:
            self._session = open_session(path, threads=1, provider=provider)
        except ValueError as problem:
            raise EncoderError(f"the exported tower {path} cannot be run: {problem}") from problem
        source_id = self._session.get_modelmeta().custom_metadata_map.get(ENCODER_KEY)
        if source_id != encoder_id:
            raise EncoderError(
                f"{path} was exported from {source_id or 'another program'}, "
                f"not from {encoder_id}: export it again"
            )
        self._shape = tuple(self._session.get_inputs()[0].shape)

    def __call__(self, pixel_values: F32) -> F16:
        """See ``Tower``."""
        if pixel_values.shape != self._shape:
            have, want = self._shape, pixel_values.shape
            raise EncoderError(
                f"{self._path} was exported for {have[3]} x {have[2]}, this image needs "
                f"{want[3]} x {want[2]}: set perception.encoder.warm_up_px to the camera's "
                "size and export it again"
            )
        try:
            features: F32 = self._session.run([OUTPUT], {INPUT: pixel_values})[0][0]
        except Exception as problem:  # onnxruntime's errors share no other base class
            reason = str(problem).splitlines()[0]
            raise EncoderError(f"onnxruntime failed on {self._path}: {reason}") from problem
        norms = np.linalg.norm(features, axis=-1, keepdims=True)
        with np.errstate(invalid="ignore"):  # zero and infinite features are refused below
            unit: F16 = (features / norms).astype(np.float16)
        if not np.isfinite(unit).all():
            raise EncoderError(f"the features of {self._path} are not finite")
        return unit
