"""Labelled places from YAML and from scenes, and a map's answers against them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.geometry import F32
from onemap_shared.grid import GridSpec
from onemap_shared.messages import SimilarityReply
from onemap_simulator.scene.loading import load_scene
from onemap_tools.bench.places import (
    MARGIN_M,
    PlaceLabel,
    labels_of_scene,
    place_results,
    read_labels,
    same_thing,
    table_lines,
    totals,
)
from tests.structure import ROOT
from tests.tools.bench.furnished import write_room

VOCABULARY = load_vocabulary(SHIPPED)


def place(name: str, x: float, y: float, radius_m: float) -> PlaceLabel:
    return PlaceLabel(name=name, x=x, y=y, radius_m=radius_m)


GRID = GridSpec(0.5, (0, 0), (20, 10))  # 10 x 5 m
SOFA, OTHER_SOFA = place("sofa", 2.0, 2.0, 1.0), place("sofa", 8.0, 2.0, 1.0)
BED = place("bed", 5.0, 4.0, 0.8)
HIDDEN = place("oven", 9.5, 4.5, 0.3)  # where nothing was observed


def reply(text: str, *places: tuple[float, float, float]) -> SimilarityReply:
    """Answers at these places (x, y, score), best first; 0.1 elsewhere, one corner not seen."""
    scores: F32 = np.full(GRID.shape, 0.1, np.float32)
    scores[18:, 8:] = np.nan
    for x, y, score in places:
        scores[tuple(GRID.cells(np.array([x, y])))] = score
    centres = np.array([place[:2] for place in places], np.float32).reshape(-1, 2)
    best = np.array([place[2] for place in places], np.float32)
    extents = np.concatenate([centres, centres], axis=1)
    return SimilarityReply(
        text,
        1,
        1,
        "e",
        centres,
        extents,
        best,
        np.ones_like(best),
        GRID,
        scores,
        last_seen_ns=np.zeros(len(best), np.int64),
        best_views=np.full((len(best), 3), np.nan, np.float32),
        heights_m=np.full((len(best), 2), np.nan, np.float32),
    )


def test_a_place_is_found_by_the_centre_of_an_answer() -> None:
    replies = {"sofa": reply("sofa", (4.9, 0.6, 0.9), (2.2, 2.2, 0.7), (1.8, 1.8, 0.6))}
    found, missed = place_results([SOFA, OTHER_SOFA], replies, VOCABULARY)
    assert (found["rank"], found["found"]) == (2, True)
    assert (missed["rank"], missed["found"]) == (None, False)
    assert (found["best_here"], missed["best_here"]) == pytest.approx((0.7, 0.1))
    assert (found["best_elsewhere"], missed["best_elsewhere"]) == pytest.approx((0.9, 0.9))


def test_what_a_place_looks_like_is_never_another_name_of_it() -> None:
    replies = {
        "sofa": reply("sofa", (2.0, 2.0, 0.5)),
        "couch": reply("couch", (2.0, 2.0, 0.99)),
        "rug": reply("rug", (2.0, 2.0, 0.8), (8.0, 2.0, 1.0)),
        "bed": reply("bed", (2.0, 2.0, 0.6)),
    }
    assert same_thing("sofa", "couch", VOCABULARY)
    assert not same_thing("printer", "whiteboard", VOCABULARY)  # both of no class
    (result,) = place_results([SOFA], replies, VOCABULARY)
    assert result["looks_like"] == "rug"
    assert result["looks_like_score"] == pytest.approx(0.8)
    (alone,) = place_results([SOFA], {"sofa": replies["sofa"]}, VOCABULARY)
    assert (alone["looks_like"], alone["looks_like_score"]) == (None, None)


def test_totals_count_places_and_first_answers() -> None:
    labels = [SOFA, OTHER_SOFA, BED, HIDDEN, place("gizmo", 2.0, 2.0, 1.0)]
    replies = {
        "sofa": reply("sofa", (8.0, 2.0, 0.9), (2.2, 2.2, 0.7)),
        "bed": reply("bed", (1.0, 1.0, 0.9), (5.0, 4.0, 0.6)),
        "oven": reply("oven"),
        "gizmo": None,
    }
    results = place_results(labels, replies, VOCABULARY)
    hidden, unknown = results[3:]
    assert (hidden["mapped"], hidden["best_here"], hidden["looks_like"]) == (False, None, None)
    assert (unknown["known"], unknown["mapped"], unknown["found"]) == (False, True, False)
    counts = totals(labels, results, replies)
    assert counts == {
        "labelled": 5,
        "found": 3,
        "not_mapped": 1,
        "names": 4,
        "first_answer_right": 1,
        "first_answer_wrong": 1,
        "without_answer": 2,
        "unknown_words": ["gizmo"],
    }
    document = {
        **counts,
        "places": results,
        "encoder_id": "mini",
        "frames": 5,
        "cells": 99,
        "seconds": 1.25,
        "bounds_m": GRID.bounds_m,
    }
    lines = table_lines(document)
    assert lines[0].split()[:3] == ["name", "x", "y"]
    assert [line.split()[-1] for line in lines[4:6]] == ["-", "0.70"]
    assert "not mapped" in lines[4]
    assert "unknown word" in lines[5]
    assert lines[-3].startswith("3 of 5 places found; of 4 names the first answer is right for 1")
    assert lines[-2] == "Not asked for, unknown to the encoder: gizmo."
    assert lines[-1] == "mini, 5 frames, 99 cells, 1.2 s"
    assert len(table_lines({**document, "unknown_words": []})) == len(lines) - 1


def test_places_outside_the_map_are_named() -> None:
    far = [place("bed", 40.0, 2.0, 1.0), place("sofa", 2.0, -1.5, 0.3)]
    reaches_in = place("sofa", 10.5, 2.0, 1.0)
    replies = {"sofa": reply("sofa", (9.9, 2.0, 0.9)), "bed": reply("bed"), "oven": reply("oven")}
    results = place_results([SOFA, HIDDEN, reaches_in, *far], replies, VOCABULARY)
    assert [result["mapped"] for result in results] == [True, False, True, False, False]
    assert results[2]["found"]
    run = {"encoder_id": "mini", "frames": 5, "cells": 99, "seconds": 1.25}
    document = {**totals([SOFA], results[:1], replies), **run, "bounds_m": GRID.bounds_m}
    assert table_lines({**document, "places": results})[-2] == (
        "Not mapped because outside the map, which reaches from (0.0, 0.0) to (10.0, 5.0) m: "
        "bed at (40, 2), sofa at (2, -1.5)."
    )
    assert "outside" not in "".join(table_lines({**document, "places": results[:3]}))


def labels_file(folder: Path, text: str) -> Path:
    path = folder / "labels.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_labels_of_the_photographs_are_valid() -> None:
    labels = read_labels(ROOT / "tests" / "data" / "rgbd_study.yaml")
    assert len(labels) == 17
    assert {"sofa", "chair", "table"} <= {label.name for label in labels}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "should be a valid list; it must be a list of places with name, x, y, radius_m"),
        ("- sofa", "entry 1: Input should be a valid dictionary"),
        ("- {x: 1, y: 1, radius_m: 1}", "entry 1: name Field required"),
        ("- {name: a, x: 1, y: 1, radius_m: 1, z: 2}", "entry 1: z Extra inputs"),
        ("- {name: '', x: 1, y: 1, radius_m: 1}", "entry 1: name String should have at least"),
        ("- {name: a, x: left, y: 1, radius_m: 1}", "entry 1: x Input should be a valid number"),
        ("- {name: a, x: 1, y: .nan, radius_m: 1}", "entry 1: y Input should be"),
        ("- {name: a, x: -1.0e+300, y: 1, radius_m: 1}", "entry 1: x Input should be greater"),
        ("- {name: a, x: 1, y: 1, radius_m: 0}", "entry 1: radius_m Input should be greater"),
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
