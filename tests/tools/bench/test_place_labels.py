"""Labelled places from YAML and from scenes."""

from __future__ import annotations

from pathlib import Path

import pytest

from onemap_simulator.scene.loading import load_scene
from onemap_tools.bench.place_labels import MARGIN_M, PlaceLabel, labels_of_scene, read_labels
from tests.structure import ROOT
from tests.tools.bench.furnished import write_room


def labels_file(folder: Path, text: str) -> Path:
    path = folder / "labels.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_labels_are_read(tmp_path: Path) -> None:
    path = labels_file(tmp_path, "- {name: sofa, x: 1, y: -2.5, radius_m: 0.5}\n")
    assert read_labels(path) == (PlaceLabel("sofa", 1.0, -2.5, 0.5),)


def test_the_labels_of_the_photographs_are_valid() -> None:
    labels = read_labels(ROOT / "tests" / "data" / "rgbd_study.yaml")
    assert len(labels) == 17
    assert {"sofa", "chair", "table"} <= {label.name for label in labels}


def test_no_places_are_a_list_too(tmp_path: Path) -> None:
    assert read_labels(labels_file(tmp_path, "[]\n")) == ()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "must be a list of places, each with name, x, y, radius_m, or [] for none"),
        ("sofa: 1", "must be a list of places"),
        ("- sofa", "entry 1 is 'sofa'; it must have name, x, y, radius_m"),
        ("- {x: 1, radius_m: 1}", "entry 1 lacks name, y"),
        ("- {name: a, x: 1, y: 1, radius_m: 1, z: 2}", "entry 1 has the unknown key 'z'"),
        ("- {name: '', x: 1, y: 1, radius_m: 1}", "entry 1: name is ''; it must be a word"),
        ("- {name: a, x: left, y: 1, radius_m: 1}", "entry 1: x is 'left'; it must be a number"),
        ("- {name: a, x: 1, y: .nan, radius_m: 1}", "entry 1: y is nan; it must be a number"),
        (
            "- {name: a, x: -1.0e+300, y: 1, radius_m: 1}",
            "it must be a number of metres up to 100000",
        ),
        ("- {name: a, x: 1, y: 1, radius_m: 0}", "entry 1: radius_m is 0; it must be positive"),
        ("- {name: a, x: 1", "is not valid YAML"),
    ],
)
def test_a_wrong_entry_is_named(tmp_path: Path, text: str, reason: str) -> None:
    path = labels_file(tmp_path, text)
    with pytest.raises(ValueError, match=r"labels\.yaml") as error:
        read_labels(path)
    assert reason in str(error.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"cannot read .*none\.yaml: No such file"):
        read_labels(tmp_path / "none.yaml")


def test_a_scene_labels_its_furniture(tmp_path: Path) -> None:
    labels = {
        each.name: each for each in labels_of_scene(load_scene(write_room(tmp_path / "a.glb")))
    }
    assert set(labels) == {
        *("bed", "sofa", "table", "chair", "bookcase", "refrigerator", "television"),
    }
    table = labels["table"]
    assert (table.x, table.y) == pytest.approx((4.15, 3.65), abs=0.01)
    assert table.radius_m == pytest.approx((1.5**2 + 0.9**2) ** 0.5 / 2 + MARGIN_M, abs=0.01)
