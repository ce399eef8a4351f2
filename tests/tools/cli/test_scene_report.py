"""What is reported of a scene file."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from onemap_tools.cli.scene_report import describe, document, draw, examine
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from tests.simulator.test_inspection import room


def printed(file: Path) -> str:
    out = io.StringIO()
    describe(examine(file), None, Console(file=out, width=200))
    return out.getvalue()


def test_the_document_holds_lengths_areas_and_the_start(tmp_path: Path) -> None:
    report = document(examine(room(tmp_path, yaml="start: [-1, -1, 0.5]")), None)
    assert report["start"] == [-1.0, -1.0, 0.5]
    assert report["start_from_yaml"] is True
    low, high = report["extent_m"]
    assert high[0] - low[0] == pytest.approx(4.0)
    assert 0 < report["reachable_m2"] < 16
    assert report["picture"] is None


def test_categories_size_and_verdict_are_printed(tmp_path: Path) -> None:
    text = printed(room(tmp_path, yaml="categories: {Sofa-01: couch}\nstart: [-1, -1, 0]"))
    for part in ("couch", "YAML", "Size: 4.00 x 4.00", "Start: (-1.00, -1.00) m", "can search"):
        assert part in text


def test_the_problems_of_a_scene_are_printed(tmp_path: Path) -> None:
    text = printed(room(tmp_path, yaml="start: [9, 9, 0]"))
    assert "No robot can search here." in text


def test_a_file_that_is_not_a_scene_is_a_usage_error(tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(b"not a scene")
    with pytest.raises(CliError, match="cannot be read") as error:
        examine(tmp_path / "a.glb")
    assert error.value.exit_code == EXIT_USAGE_ERROR


def test_the_floor_plan_is_written_into_a_new_folder(tmp_path: Path) -> None:
    inspection = examine(room(tmp_path))
    assert draw(inspection, tmp_path / "new" / "plan.png") == tmp_path / "new" / "plan.png"
    assert (tmp_path / "new" / "plan.png").stat().st_size > 0
    (tmp_path / "file").touch()
    with pytest.raises(CliError, match="Cannot write the picture"):
        draw(inspection, tmp_path / "file" / "plan.png")
