"""The interface of detectors, also of plugins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from onemap_shared.geometry import F16, U8, Bool
from onemap_shared.messages import TextEmbeddings


@dataclass(frozen=True, slots=True)
class Image:
    """rgb (H, W, 3) uint8 and, for a detector that reads them, the encoder's features (h, w, D)
    float16 of the same image."""

    rgb: U8
    features: F16 | None = None


@dataclass(frozen=True, slots=True)
class Detection:
    """One detection. box_px: x0, y0, x1, y1; mask (h, w) bool: the cells it covers of a grid
    laid over the whole image, patches of the encoder or single pixels. Scores are comparable
    where ``scale`` is the same."""

    name: str
    score: float
    box_px: tuple[float, float, float, float]
    mask: Bool
    scale: str = ""


class Detector(Protocol):
    """Finds objects of the given names. Thresholds belong to the detector."""

    @property
    def detector_id(self) -> str:
        """Names the detector and its weights."""

    @property
    def reads_features(self) -> bool:
        """Whether it needs the encoder's features. If not, it runs in a thread of its own, at the
        same time as the encoder."""

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        """Detections of ``names.texts``, best first."""
