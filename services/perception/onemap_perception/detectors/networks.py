"""Networks of boxes: RT-DETRv2 for the eighty names of COCO, any grounding one for any name.

LLMDet, GroundingDINO and OWLv2 are such grounding networks of transformers.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import torch

from onemap_perception.detectors.boxes import Box
from onemap_perception.encoders.checkpoint import fingerprint, inference, load_pretrained
from onemap_perception.encoders.images import resized
from onemap_perception.errors import TRANSFORMERS, BackendError, first_line, optional_import
from onemap_shared.geometry import U8
from onemap_shared.names import normalised

SIDE_PX = 640  # RT-DETR's own square; it was trained on images squeezed into it
# COCO's names, with usual other ones.
USUAL_NAMES = {
    "couch": ("sofa", "settee"),
    "tv": ("television", "tv set", "telly", "tv monitor"),
    "potted plant": ("plant", "houseplant", "house plant"),
    "refrigerator": ("fridge",),
    "cell phone": ("phone", "mobile phone", "cellphone"),
    "bicycle": ("bike",),
    "motorcycle": ("motorbike",),
    "airplane": ("plane", "aeroplane"),
    "hair drier": ("hairdryer", "hair dryer"),
    "teddy bear": ("teddy",),
    "donut": ("doughnut",),
    "wine glass": ("wineglass",),
}
SYNONYMS = {usual: name for name, others in USUAL_NAMES.items() for usual in others}


class CocoNetwork:
    """Implements ``BoxNetwork``. Raises BackendError when it cannot be loaded."""

    def __init__(self, folder: Path, device: torch.device) -> None:
        with optional_import("transformers", TRANSFORMERS, backend="coco"):
            from transformers import RTDetrV2ForObjectDetection
        model = load_pretrained(
            RTDetrV2ForObjectDetection,
            folder,
            what="RT-DETRv2 model",
            use_safetensors=True,
        )
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


class GroundingNetwork:
    """Implements ``BoxNetwork``. Raises BackendError when it cannot be loaded."""

    def __init__(self, folder: Path, device: torch.device) -> None:
        with optional_import("transformers", TRANSFORMERS, backend="open_vocabulary"):
            from transformers import AutoModelForZeroShotObjectDetection, AutoProcessor
        model = load_pretrained(
            AutoModelForZeroShotObjectDetection,
            folder,
            what="grounding detector",
            use_safetensors=True,
        )
        try:
            self._processor = AutoProcessor.from_pretrained(folder, local_files_only=True)
        except Exception as problem:  # of transformers, tokenizers and the disk
            raise BackendError(f"{folder} holds no processor: {first_line(problem)}") from problem
        self.network_id = "open_vocabulary-" + fingerprint(model.state_dict().items())
        self._device = device
        self._model = model.to(device)

    def supports(self, _: str, /) -> bool:
        """Every name is supported."""
        return True

    def boxes(self, rgb: U8, names: Sequence[str], score_threshold: float) -> list[Box]:
        """See ``BoxNetwork``. One run per name: given two, these networks confuse them."""
        return [box for name in names for box in self._boxes_of(name, rgb, score_threshold)]

    def _boxes_of(self, name: str, rgb: U8, score_threshold: float) -> list[Box]:
        import PIL.Image

        height, width = rgb.shape[:2]
        prompt = [[name.lower()]]
        with inference(self._device, (width, height)):
            inputs = self._processor(
                images=PIL.Image.fromarray(rgb), text=prompt, return_tensors="pt"
            ).to(self._device)
            (answer,) = self._processor.post_process_grounded_object_detection(
                self._model(**inputs),
                threshold=score_threshold,
                target_sizes=[(height, width)],
                text_labels=prompt,
            )
        scores, corners = answer["scores"].tolist(), answer["boxes"].tolist()
        return [Box(name, score, tuple(box)) for score, box in zip(scores, corners, strict=True)]
