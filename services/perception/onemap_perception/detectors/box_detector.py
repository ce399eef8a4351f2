"""Detectors that are a network of transformers whose answers are boxes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

from onemap_perception.detectors.boxes import Box, detections_from_boxes
from onemap_perception.detectors.params import BoxParams
from onemap_perception.detectors.protocol import Detection, DetectorError, Image
from onemap_shared.geometry import U8
from onemap_shared.messages import TextEmbeddings


class BoxNetwork(Protocol):
    """Finds boxes of named objects in an image."""

    @property
    def network_id(self) -> str:
        """The backend and a digest of the weights."""

    def supports(self, name: str, /) -> bool:
        """Whether the network can find objects of this name."""

    def boxes(self, rgb: U8, names: Sequence[str], score_threshold: float) -> list[Box]:
        """Boxes in an image (H, W, 3) of the names it supports, from the threshold on."""


class BoxDetector:
    """Implements ``Detector`` for a network of boxes."""

    reads_features = False

    def __init__(self, network: BoxNetwork, params: BoxParams) -> None:
        self.detector_id = network.network_id
        self._network = network
        self._params = params

    def supports(self, name: str) -> bool:
        """Whether objects of this name can be found."""
        return self._network.supports(name)

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        """See ``Detector``; there are no detections of names the network does not support."""
        supported = [name for name in names.texts if self.supports(name)]
        if not supported:
            return ()
        height, width = image.rgb.shape[:2]
        return detections_from_boxes(
            self._network.boxes(image.rgb, supported, self._params.score_threshold),
            (width, height),
            score_threshold=self._params.score_threshold,
            max_detections=self._params.max_detections,
        )


def load_pretrained(kind: Any, folder: Path, what: str) -> Any:
    """The model of this class, for inference; DetectorError unless every tensor was there."""
    try:
        model, report = kind.from_pretrained(
            folder, local_files_only=True, use_safetensors=True, output_loading_info=True
        )
    except Exception as problem:  # of transformers, safetensors and the disk
        reason = (str(problem).strip() or repr(problem)).splitlines()[0]
        raise DetectorError(f"{folder} holds no {what}: {reason}") from problem
    missing = sorted(report["missing_keys"])
    if missing:
        raise DetectorError(f"{folder} is of another architecture: it lacks {missing[0]}")
    return model.float().eval().requires_grad_(False)
