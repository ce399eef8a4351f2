from __future__ import annotations

from pathlib import Path

import pytest

from onemap_simulator.scene.corrections import Corrections, read_corrections

PAGE = Path(__file__).parents[3] / "docs" / "scenes.md"


def test_no_file_corrects_nothing(tmp_path: Path) -> None:
    assert read_corrections(tmp_path / "flat.yaml") == Corrections()


def test_the_example_in_the_documentation_is_read(tmp_path: Path) -> None:
    page = PAGE.read_text(encoding="utf-8")
    (tmp_path / "flat.yaml").write_text(page.partition("```yaml\n")[2].partition("```")[0])
    corrections = read_corrections(tmp_path / "flat.yaml")
    assert corrections.categories == {"geometry_12": "sofa", "Cube.004": "coffee table"}
    assert corrections.start == (1.5, 2.0, 0.0)
    assert corrections.up == "z"
    assert corrections.floor_m == 0.0


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("start: [1, 2", "not valid YAML"),
        ("- 1", "keys and values"),
        ("starts: [1, 2, 3]", "unknown key 'starts'"),
        ("start: [1, 2]", "three numbers"),
        ("start: [1, 2, .nan]", "three numbers"),
        ("start: here", "three numbers"),
        ("up: x", "must be y or z"),
        ("floor: low", "height in metres"),
        ("floor: true", "height in metres"),
        ("categories: [sofa]", "must map"),
        ("categories: {Sofa-01: 3}", "must map"),
    ],
)
def test_a_wrong_yaml_is_refused_with_the_reason(tmp_path: Path, text: str, reason: str) -> None:
    (tmp_path / "room.yaml").write_text(text)
    with pytest.raises(ValueError, match=reason) as caught:
        read_corrections(tmp_path / "room.yaml")
    assert "\n" not in str(caught.value)
