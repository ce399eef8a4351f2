"""RT-DETRv2 for the eighty names of COCO."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch

from onemap_perception.detectors.boxes import Box, BoxLimits, detections_from_boxes
from onemap_perception.detectors.names import coco_name
from onemap_perception.detectors.pretrained import pretrained
from onemap_perception.detectors.protocol import Detection, DetectorError, Image
from onemap_perception.encoders.checkpoint import fingerprint
from onemap_perception.encoders.image import resized
from onemap_perception.optional_import import TRANSFORMERS, optional_import
from onemap_perception.torch_device import inference, open_device
from onemap_shared.messages import TextEmbeddings

SIDE_PX = 640  # RT-DETR's own square; it was trained on images squeezed into it


@dataclass(frozen=True, slots=True)
class CocoSettings:
    """folder: as the hub lays it out; device: cpu, cuda or cuda:N."""

    folder: Path
    device: str = "cpu"
    limits: BoxLimits = field(default_factory=lambda: BoxLimits(score=0.5))


class CocoDetector:
    """Implements ``Detector``. Raises DetectorError when it cannot be loaded."""

    reads_features = False

    def __init__(self, settings: CocoSettings) -> None:
        self._device = open_device(settings.device)
        self._limits = settings.limits
        model = load_model(settings.folder)
        self._id = "coco-" + fingerprint(model.state_dict().items())
        self._labels = {name: int(label) for label, name in model.config.id2label.items()}
        self._model = model.to(self._device)

    @property
    def detector_id(self) -> str:
        """``coco-`` and a digest of the weights."""
        return self._id

    def supports(self, name: str) -> bool:
        """Whether the name, or its usual synonym, is one of the network's labels."""
        return coco_name(name) in self._labels

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        """See ``Detector``; names that COCO lacks are found nowhere."""
        wanted = {
            self._labels[coco_name(name)]: name for name in names.texts if self.supports(name)
        }
        if not wanted:
            return ()
        scores, corners = self._run(image)
        boxes = [
            Box(name, float(scores[query, label]), tuple(corners[query].tolist()))
            for label, name in wanted.items()
            for query in torch.nonzero(scores[:, label] >= self._limits.score).ravel().tolist()
        ]
        return detections_from_boxes(boxes, image.rgb, self._limits)

    def _run(self, image: Image) -> tuple[torch.Tensor, torch.Tensor]:
        """Scores (Q, labels) in [0, 1] and corners (Q, 4) in pixels of the image."""
        height, width = image.rgb.shape[:2]
        square = resized(image.rgb, (SIDE_PX, SIDE_PX))
        pixel_values = (
            torch.from_numpy(square).permute(2, 0, 1)[None].to(self._device).float() / 255
        )
        with inference(self._device, (width, height)):
            answer = self._model(pixel_values=pixel_values)
            centre, size = answer.pred_boxes[0].float().cpu().split(2, dim=-1)
            corners = torch.cat([centre - size / 2, centre + size / 2], dim=-1)
            scores = answer.logits[0].float().cpu().sigmoid()
        return scores, corners * torch.tensor([width, height, width, height])


def load_model(folder: Path) -> Any:
    """The network from files of this machine; DetectorError if it is not whole."""
    with optional_import("transformers", TRANSFORMERS, backend="coco", kind=DetectorError):
        from transformers import RTDetrV2ForObjectDetection
    return pretrained(RTDetrV2ForObjectDetection, folder, "RT-DETRv2 model")
