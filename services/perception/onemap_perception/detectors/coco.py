"""RT-DETRv2 for the eighty names of COCO."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch

from onemap_perception.detectors.box_detector import load_pretrained
from onemap_perception.detectors.boxes import Box
from onemap_perception.detectors.protocol import DetectorError
from onemap_perception.encoders.checkpoint import fingerprint
from onemap_perception.encoders.image import resized
from onemap_perception.optional_import import TRANSFORMERS, optional_import
from onemap_perception.torch_device import inference
from onemap_shared.geometry import U8
from onemap_shared.names import normalised

SIDE_PX = 640  # RT-DETR's own square; it was trained on images squeezed into it
# Usual names of objects, with COCO's name.
SYNONYMS = {
    "sofa": "couch",
    "settee": "couch",
    "television": "tv",
    "tv set": "tv",
    "telly": "tv",
    "tv monitor": "tv",
    "plant": "potted plant",
    "houseplant": "potted plant",
    "house plant": "potted plant",
    "fridge": "refrigerator",
    "phone": "cell phone",
    "mobile phone": "cell phone",
    "cellphone": "cell phone",
    "bike": "bicycle",
    "motorbike": "motorcycle",
    "plane": "airplane",
    "aeroplane": "airplane",
    "hairdryer": "hair drier",
    "hair dryer": "hair drier",
    "teddy": "teddy bear",
    "doughnut": "donut",
    "wineglass": "wine glass",
}


class CocoNetwork:
    """Implements ``BoxNetwork``. Raises DetectorError when it cannot be loaded."""

    def __init__(self, folder: Path, device: torch.device) -> None:
        model = load_model(folder)
        self.network_id = "coco-" + fingerprint(model.state_dict().items())
        self._labels = {name: int(label) for label, name in model.config.id2label.items()}
        self._device = device
        self._model = model.to(device)

    def supports(self, name: str) -> bool:
        """Whether the name, or its usual synonym, is one of the network's labels."""
        return coco_name(name) in self._labels

    def boxes(self, rgb: U8, names: Sequence[str], score_threshold: float) -> list[Box]:
        """See ``BoxNetwork``; all names in one run."""
        name_of = {self._labels[coco_name(name)]: name for name in names}
        scores, corners = self._run(rgb)
        return [
            Box(name, float(scores[query, label]), tuple(corners[query].tolist()))
            for label, name in name_of.items()
            for query in torch.nonzero(scores[:, label] >= score_threshold).ravel().tolist()
        ]

    def _run(self, rgb: U8) -> tuple[torch.Tensor, torch.Tensor]:
        """Scores (Q, labels) in [0, 1] and corners (Q, 4) in pixels of the image."""
        height, width = rgb.shape[:2]
        square = resized(rgb, (SIDE_PX, SIDE_PX))
        planes = torch.from_numpy(square).permute(2, 0, 1)[None].to(self._device).float() / 255
        with inference(self._device, (width, height)):
            answer = self._model(pixel_values=planes)
            centre, size = answer.pred_boxes[0].float().cpu().split(2, dim=-1)
            corners = torch.cat([centre - size / 2, centre + size / 2], dim=-1)
            scores = answer.logits[0].float().cpu().sigmoid()
        return scores, corners * torch.tensor([width, height, width, height])


def coco_name(name: str) -> str:
    """The name as COCO writes it: normalised, and COCO's word for a synonym."""
    word = normalised(name)
    return SYNONYMS.get(word, word)


def load_model(folder: Path) -> Any:
    """The network from files of this machine; DetectorError if it is not whole."""
    with optional_import("transformers", TRANSFORMERS, backend="coco", kind=DetectorError):
        from transformers import RTDetrV2ForObjectDetection
    return load_pretrained(RTDetrV2ForObjectDetection, folder, "RT-DETRv2 model")
