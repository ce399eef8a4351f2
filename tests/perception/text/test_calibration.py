"""Reading ``calibration.json``."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import pytest

from onemap_perception.text.calibration import Calibration, load_calibration


def test_every_value_is_read(tmp_path: Path) -> None:
    calibration = Calibration(12.0, 1.0, 20.0, 0.7, floor=0.2, placed=0.3)
    (tmp_path / "calibration.json").write_text(json.dumps(asdict(calibration)))
    assert load_calibration(tmp_path) == calibration


def test_a_calibration_without_a_floor_has_not_measured_one(tmp_path: Path) -> None:
    (tmp_path / "calibration.json").write_text(
        '{"temperature": 3, "expansion": 1, "sharpness": 20, "synonym": 0.7}'
    )
    loaded = load_calibration(tmp_path)
    assert (loaded.floor, loaded.placed) == (0.0, 0.0)


@pytest.mark.parametrize("content", ["{", "[]", '{"temperature": 3}', '{"temperature": "warm"}'])
def test_a_damaged_calibration_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "calibration.json").write_text(content)
    with pytest.raises(ValueError, match="cannot read the calibration"):
        load_calibration(tmp_path)
