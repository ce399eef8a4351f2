"""The figures of an evaluation as lines for people."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

WORST = 8  # words shown by name


def lines(figures: dict[str, Any]) -> Iterator[str]:
    """One short paragraph per set of frames."""
    yield f"encoder {figures['encoder_id']}"
    for name in ("held_out", "other_style"):
        part = figures[name]
        yield f"{name}: {part['frames']} frames, {part['classes']} classes"
        yield (
            f"  pixel accuracy {part['pixel_accuracy']:.3f}  mIoU {part['miou']:.3f}  "
            f"calibration error {part['calibration_error']:.3f}"
        )
        detector = part["detector"]
        yield (
            f"  detector patches: precision {detector['precision']:.3f}  "
            f"recall {detector['recall']:.3f}"
        )
        for words in ("names", "held_out_aliases"):
            row = part[words]
            yield (
                f"  {words}: R-precision {row['r_precision']:.3f}  "
                f"AUROC {row['auroc_mean_over_words']:.3f}, pooled {row['auroc_pooled']:.3f}"
            )
            worst = list(row["r_precision_by_word"].items())[:WORST]
            yield "    worst: " + ", ".join(f"{word} {value:.2f}" for word, value in worst)
