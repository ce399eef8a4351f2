"""A detector that waits until a test lets it finish."""

from __future__ import annotations

import threading

import numpy as np

from onemap_perception.detectors.protocol import Detection, Image
from onemap_perception.errors import BackendError
from onemap_shared.messages import TextEmbeddings


class SlowDetector:
    """Implements ``Detector``: one detection per frame, or an error, once ``finish`` is set."""

    detector_id = "slow"
    reads_features = False

    def __init__(self) -> None:
        self.finish = threading.Event()
        self.broken = False

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        assert image.features is None
        assert self.finish.wait(60)
        if self.broken:
            raise BackendError("the weights are damaged")
        return (Detection(names.texts[0], 0.9, (0, 0, 8, 8), np.ones((1, 1), bool)),)
