"""The benchmark runs and says what it measured; how fast it must be is no unit test's matter."""

from __future__ import annotations

import json

import pytest

from onemap_tools.bench import fusion


def test_the_last_line_is_the_result(capsys: pytest.CaptureFixture[str]) -> None:
    assert fusion.main(["--frames", "2", "--json"]) == 0
    result = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert result["frames"] == 2
    assert result["image"] == "640x480"
    assert 0 < result["min_ms"] <= result["p50_ms"] <= result["p95_ms"]
    assert result["cells"] > 1000


def test_people_get_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert fusion.main(["--frames", "1"]) == 0
    assert "p50_ms" in capsys.readouterr().out


def test_no_frames_cannot_be_measured() -> None:
    with pytest.raises(ValueError, match="frames is 0"):
        fusion.run(0)
