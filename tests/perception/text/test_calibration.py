"""Reading ``calibration.json``."""

from __future__ import annotations

from pathlib import Path

import pytest

from onemap_perception.text.calibration import load_calibration


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
