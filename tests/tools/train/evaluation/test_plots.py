"""The model card's plots."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np

from onemap_tools.train.evaluation.plots import draw_confusion, draw_reliability


def part(confusion: list[list[int]], right: float) -> dict[str, Any]:
    """Two classes and one bin."""
    return {
        "class_names": ["wall", "sofa"],
        "confusion": confusion,
        "reliability": [{"stated": 0.1, "right": right, "count": 5.0}],
    }


def test_plots_follow_the_figures(tmp_path: Path) -> None:
    images: list[list[np.ndarray]] = [[], []]
    for confusion, right in (([[90, 10], [0, 0]], 0.2), ([[0, 10], [5, 0]], 0.9)):
        figures = part(confusion, right)
        paths = (draw_confusion(figures, tmp_path), draw_reliability({"a": figures}, tmp_path))
        for kind, path in zip(images, paths, strict=True):
            image = cv2.imread(str(path))
            assert image is not None
            assert min(image.shape[:2]) > 300
            kind.append(image)
    for first, second in images:
        assert not np.array_equal(first, second)


def test_the_same_figures_give_the_same_file(tmp_path: Path) -> None:
    figures = part([[9, 1], [2, 8]], 0.2)
    written = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        written.append(draw_confusion(figures, tmp_path / name).read_bytes())
    assert written[0] == written[1]
