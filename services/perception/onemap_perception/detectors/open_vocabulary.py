"""Any grounding detector of transformers for any name: LLMDet, GroundingDINO, OWLv2."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from onemap_perception.detectors.boxes import Box, BoxLimits, detections_from_boxes
from onemap_perception.detectors.pretrained import pretrained
from onemap_perception.detectors.protocol import Detection, DetectorError, Image
from onemap_perception.encoders.checkpoint import fingerprint
from onemap_perception.optional_import import TRANSFORMERS, optional_import
from onemap_perception.torch_device import inference, open_device
from onemap_shared.messages import TextEmbeddings


@dataclass(frozen=True, slots=True)
class OpenVocabularySettings:
    """folder: as the hub lays it out; device: cpu, cuda or cuda:N."""

    folder: Path
    device: str = "cpu"
    limits: BoxLimits = field(default_factory=lambda: BoxLimits(score=0.35))


class OpenVocabularyDetector:
    """Implements ``Detector``. Raises DetectorError when it cannot be loaded."""

    reads_features = False

    def __init__(self, settings: OpenVocabularySettings) -> None:
        self._device = open_device(settings.device)
        self._limits = settings.limits
        model, self._processor = load_model(settings.folder)
        self._id = "open_vocabulary-" + fingerprint(model.state_dict().items())
        self._model = model.to(self._device)

    @property
    def detector_id(self) -> str:
        """``open_vocabulary-`` and a digest of the weights."""
        return self._id

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        """See ``Detector``. One run per name: asked for two, these networks mix the words up."""
        boxes = [box for name in names.texts for box in self._boxes_of(name, image)]
        return detections_from_boxes(boxes, image.rgb, self._limits)

    def _boxes_of(self, name: str, image: Image) -> list[Box]:
        import PIL.Image

        height, width = image.rgb.shape[:2]
        asked = [[name.lower()]]
        with inference(self._device, (width, height)):
            inputs = self._processor(
                images=PIL.Image.fromarray(image.rgb), text=asked, return_tensors="pt"
            ).to(self._device)
            (answer,) = self._processor.post_process_grounded_object_detection(
                self._model(**inputs),
                threshold=self._limits.score,
                target_sizes=[(height, width)],
                text_labels=asked,
            )
        scores, corners = answer["scores"].tolist(), answer["boxes"].tolist()
        return [Box(name, score, tuple(box)) for score, box in zip(scores, corners, strict=True)]


def load_model(folder: Path) -> tuple[Any, Any]:
    """Model and processor from files of this machine; DetectorError if either fails."""
    with optional_import(
        "transformers", TRANSFORMERS, backend="open_vocabulary", kind=DetectorError
    ):
        from transformers import AutoModelForZeroShotObjectDetection, AutoProcessor
    model = pretrained(AutoModelForZeroShotObjectDetection, folder, "grounding detector")
    try:
        return model, AutoProcessor.from_pretrained(folder, local_files_only=True)
    except Exception as problem:  # of transformers, tokenizers and the disk
        reason = (str(problem).strip() or repr(problem)).splitlines()[0]
        raise DetectorError(f"{folder} holds no processor: {reason}") from problem
