"""The figures on the foreign test set as text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

ROWS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("pixel accuracy", ("pixel_accuracy",)),
    ("mIoU, classes of the foreign set", ("miou_foreign_classes",)),
    ("mIoU, of these the things", ("miou_foreign_things",)),
    ("R-precision, class names", ("names", "r_precision")),
    ("AUROC, mean of words", ("names", "auroc_mean_over_words")),
    ("AUROC, all words in one", ("names", "auroc_pooled")),
    ("detector `patches`, precision", ("detector", "precision")),
    ("detector `patches`, recall", ("detector", "recall")),
    ("calibration error, all words", ("calibration_error",)),
    ("calibration error, best answer", ("best_answer", "calibration_error")),
    ("best answers of 0.5 or more", ("best_answer", "sure")),
    ("of these wrong", ("best_answer", "wrong_of_sure")),
    ("pictures", ("frames",)),
)


def table_lines(result: dict[str, Any]) -> Iterator[str]:
    """Markdown: figures of each set, IoU of each class, confusions, things without a class."""
    sets: dict[str, dict[str, Any]] = result["sets"]
    yield f"encoder {result['encoder_id']}, {result['furnishings']} furnishings of each apartment"
    yield ""
    yield from _table(
        ["", *sets],
        [[title, *(_cell(part, path) for part in sets.values())] for title, path in ROWS],
    )
    yield ""
    iou = sets["foreign"]["iou_by_class"]
    worst_first = sorted(iou, key=lambda name: float(iou[name]))
    rows = [
        [name, *(_cell(part["iou_by_class"], (name,)) for part in sets.values())]
        for name in worst_first
    ]
    yield from _table(["IoU of", *sets], rows)
    yield ""
    confusions = [
        [c["of"], c["taken_for"], f"{c['share']:.2f}"] for c in sets["foreign"]["confusions"]
    ]
    yield from _table(["of the pixels of", "are taken for", "share"], confusions)
    yield ""
    unknown = [
        [name, row["taken_for"], f"{row['share']:.2f}", f"{row['sure']:.2f}"]
        for name, row in sets["foreign"]["best_answer"]["strangers"].items()
        if row["patches"]
    ]
    yield from _table(
        ["without a class", "mostly taken for", "share", "scored 0.5 or more"], unknown
    )


def _table(head: list[str], rows: list[list[str]]) -> Iterator[str]:
    yield "| " + " | ".join(head) + " |"
    yield "|" + "---|" * len(head)
    for row in rows:
        yield "| " + " | ".join(row) + " |"


def _cell(part: dict[str, Any], path: tuple[str, ...]) -> str:
    value: Any = part
    for key in path:
        if key not in value:
            return ""
        value = value[key]
    return f"{value:.3f}" if isinstance(value, float) else str(value)
