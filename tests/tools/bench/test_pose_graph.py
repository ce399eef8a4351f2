"""The benchmark of corrections: a short drive, its table and its picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_tools.bench import pose_graph
from onemap_tools.bench.pose_graph import PoseGraphBenchParams, run, table_lines


@pytest.mark.slow
def test_a_correction_gives_back_what_drift_took(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pose_graph, "PLACES", 2)
    monkeypatch.setattr(pose_graph, "CAMERA", CameraParams(width=80, height=60))
    params = PoseGraphBenchParams((2,), drift=0.05, yaw_deg_per_m=1.0, out=tmp_path / "out")
    result = run(params)
    true, smeared, corrected = result["rows"]
    assert [row["map"] for row in result["rows"]] == list(pose_graph.ROWS)
    assert true["wrong_occupied"] < 0.01
    assert smeared["wrong_occupied"] > 0.05
    assert corrected["wrong_occupied"] < 0.5 * smeared["wrong_occupied"]
    assert corrected["wrong_free"] < smeared["wrong_free"]
    assert corrected["similarity_error_m"] <= smeared["similarity_error_m"]
    assert 0 < result["moved"] <= result["submaps"]
    assert np.isfinite([result[key] for key in ("ms_per_moved", "submap_kb", "way_m")]).all()
    assert (tmp_path / "out" / "pose_graph_2.png").stat().st_size > 1000
    lines = table_lines(result)
    assert [line.split("  ")[0] for line in lines[1:4]] == [
        "true poses",
        "not corrected",
        "corrected",
    ]


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match=r"cannot write to .*file"):
        pose_graph.write_picture(tmp_path / "file" / "x.png", np.zeros((2, 2, 3), np.uint8))
