"""Right, wrong and missed detections are counted apart."""

from __future__ import annotations

import numpy as np

from onemap_perception.detectors.protocol import Image
from onemap_tools.train.evaluation.detector_metrics import DetectorMetrics
from tests.tools.train.tiny import VOCABULARY, PerfectEncoder


def test_a_wrong_and_a_missed_detection() -> None:
    encoder = PerfectEncoder()
    rgb = np.full((48, 64, 3), 20, np.uint8)
    rgb[:32, :24] = 200  # looks like a sofa, and is a wall
    shares = np.tile(np.array([1, 0], np.float32), (48, 1))
    shares[-8:] = (0, 1)  # the sofa looks like a wall
    metrics = DetectorMetrics(VOCABULARY.names)
    metrics.add(Image(rgb, encoder.encode(rgb)), encoder.embed_text(VOCABULARY.names), shares)
    assert metrics.summary() == {"precision": 0.5, "recall": 0.5, "wrong_per_picture": 1}
