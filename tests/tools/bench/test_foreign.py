"""``onemap bench foreign`` on a few tiny pictures, and its arithmetic."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from onemap_perception.encoders.mini import MiniParams
from onemap_tools.bench.foreign import ForeignBenchParams, mean_iou, run, worst_confusions
from onemap_tools.bench.foreign_report import table_lines
from onemap_tools.foreign.frames import ForeignSetSpec

# Three furnished apartments: seconds alone, minutes on a busy machine.
pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


@pytest.fixture(scope="module")
def result() -> dict[str, Any]:
    """Of mini, two pictures of each apartment."""
    done: list[tuple[str, int, int]] = []
    params = ForeignBenchParams(ForeignSetSpec(1, 2, 96, 72))
    figures = run(MiniParams(), params, lambda *step: done.append(step))
    assert done[2] == ("rendering foreign", 3, 3)
    assert done[-1] == ("measuring foreign", 12, 12)
    return figures


def test_all_figures_are_there(result: dict[str, Any]) -> None:
    part = result["sets"]["foreign"]
    assert part["frames"] == 6
    assert 0 < part["pixel_accuracy"] < 1
    assert 0 < part["miou_foreign_classes"] < 1
    assert 0 <= part["best_answer"]["calibration_error"] < 1
    assert result["encoder_id"].startswith("mini-")
    assert result["strangers"] == ["piano", "ladder", "ironing board"]
    assert {"sofa", "refrigerator", "wall", "window"} <= set(result["classes"])


def test_the_table_names_every_set_and_class(result: dict[str, Any]) -> None:
    lines = list(table_lines(result))
    part = result["sets"]["foreign"]
    assert any(line.startswith("| mIoU, classes of the foreign set | 0.") for line in lines)
    iou = [line for line in lines if line.split(" | ")[0][2:] in part["iou_by_class"]]
    assert len(iou) >= len(part["iou_by_class"])


def test_a_missing_encoder_is_one_sentence(tmp_path: Any) -> None:
    with pytest.raises(ValueError, match=r"weights .* are missing"):
        run(MiniParams(folder=tmp_path), ForeignBenchParams(), lambda *_: None)


def test_the_mean_is_over_the_classes_that_occur() -> None:
    assert mean_iou({"sofa": 0.2, "bed": 0.6, "wall": 1.0}, ["sofa", "bed", "oven"]) == 0.4
    assert np.isnan(mean_iou({}, ["sofa"]))


def test_confusions_of_rare_classes_do_not_count() -> None:
    counts = [[5000, 5000, 0], [100, 9900, 0], [1, 0, 1]]
    worst = worst_confusions(counts, ("bed", "sofa", "cup"))
    assert worst[0] == {"of": "bed", "taken_for": "sofa", "share": 0.5}
    assert [pair["of"] for pair in worst] == ["bed", "sofa"]
