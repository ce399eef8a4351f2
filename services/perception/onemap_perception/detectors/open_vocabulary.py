"""Any grounding detector of transformers for any name: LLMDet, GroundingDINO, OWLv2."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch

from onemap_perception.detectors.box_detector import load_pretrained
from onemap_perception.detectors.boxes import Box
from onemap_perception.detectors.protocol import DetectorError
from onemap_perception.encoders.checkpoint import fingerprint
from onemap_perception.optional_import import TRANSFORMERS, optional_import
from onemap_perception.torch_device import inference
from onemap_shared.geometry import U8


class GroundingNetwork:
    """Implements ``BoxNetwork``. Raises DetectorError when it cannot be loaded."""

    def __init__(self, folder: Path, device: torch.device) -> None:
        model, self._processor = load_model(folder)
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


def load_model(folder: Path) -> tuple[Any, Any]:
    """Model and processor from files of this machine; DetectorError if either fails."""
    with optional_import(
        "transformers", TRANSFORMERS, backend="open_vocabulary", kind=DetectorError
    ):
        from transformers import AutoModelForZeroShotObjectDetection, AutoProcessor
    model = load_pretrained(AutoModelForZeroShotObjectDetection, folder, "grounding detector")
    try:
        return model, AutoProcessor.from_pretrained(folder, local_files_only=True)
    except Exception as problem:  # of transformers, tokenizers and the disk
        reason = (str(problem).strip() or repr(problem)).splitlines()[0]
        raise DetectorError(f"{folder} holds no processor: {reason}") from problem
