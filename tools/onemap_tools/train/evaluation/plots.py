"""The plots of the model card, drawn from the figures of one evaluation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

CONFUSION_FILE, RELIABILITY_FILE = "confusion.png", "reliability.png"
DPI = 110


def draw_confusion(part: dict[str, Any], folder: Path) -> Path:
    """The confusion matrix of pixels, each row normalised to its class."""
    names = part["class_names"]
    counts = np.array(part["confusion"], np.float64)
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    figure = Figure(figsize=(11, 10), layout="constrained")
    axes = figure.add_subplot()
    image = axes.imshow(share, cmap="magma_r", vmin=0, vmax=1)
    axes.set_xticks(range(len(names)), names, rotation=90, fontsize=7)
    axes.set_yticks(range(len(names)), names, fontsize=7)
    axes.set_xlabel("taken for")
    axes.set_ylabel("is")
    figure.colorbar(image, label="share of the class's pixels", shrink=0.6)
    return _save(figure, folder / CONFUSION_FILE)


def draw_reliability(parts: dict[str, dict[str, Any]], folder: Path) -> Path:
    """The reliability diagram: observed frequency of the class over the stated score."""
    figure = Figure(figsize=(5.5, 5), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color="grey", linestyle="--", label="as stated")
    for title, part in parts.items():
        rows = part["reliability"]
        stated = [row["stated"] for row in rows]
        axes.plot(stated, [row["right"] for row in rows], marker="o", label=title)
    axes.set_xlabel("score")
    axes.set_ylabel("share that is what was asked for")
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)
    axes.legend()
    return _save(figure, folder / RELIABILITY_FILE)


def _save(figure: Figure, path: Path) -> Path:
    # Without the library's version in it, the same figures give the same file.
    figure.savefig(path, dpi=DPI, metadata={"Software": None})
    return path
