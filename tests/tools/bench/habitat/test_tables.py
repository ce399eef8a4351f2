"""The paper's tables: quoted figures with their sources beside those of a run."""

from __future__ import annotations

from typing import Any

import pytest

from onemap_tools.bench.habitat.quoted import SINGLE_OBJECT, THREE_OBJECTS
from onemap_tools.bench.habitat.tables import paper_tables
from onemap_tools.bench.navigation.metrics import ratios_of, summary
from onemap_tools.bench.navigation.records import Failure
from tests.tools.bench.navigation.records import episode, failed, found


def result(objects: int) -> dict[str, Any]:
    names = ["bed", "sofa", "chair", "toilet"][:objects]
    all_found = episode(0, *(found(name, 2.0, 4.0) for name in names))
    lost = episode(1, *(failed(name, 4.0, Failure.WRONG_OBJECT) for name in names))
    return {
        "method": "onemap",
        "features": "openclip",
        "about": "Two episodes.",
        "objects_per_episode": objects,
        **summary([all_found, lost], 0),
    }


def rows(text: str) -> dict[str, list[str]]:
    """Cells of the tables' lines by their first."""
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines()]
    return {line[0]: line[1:] for line in cells if line}


def test_single_objects_stand_beside_the_paper_s_first_tables() -> None:
    text = paper_tables(result(1))
    table = rows(text)
    assert text.startswith("Two episodes. Percent, with 95 % bootstrap intervals")
    assert table["approach"] == ["SR", "SPL", "wrong claims", "source"]
    assert table["VLFM"][:3] == ["52.5", "30.4", ""]
    assert table["OneMap, the paper's"][:3] == ["55.8", "37.4", "19.5"]
    assert table["**onemap, openclip**"][0] == "50.0 [0.0, 100.0]"
    assert table["**onemap, openclip**"][1] == "25.0 [0.0, 50.0]"
    assert table["**onemap, openclip**"][-1] == "this run"


def test_sequences_of_three_stand_beside_the_paper_s_third_table_and_its_figure() -> None:
    first, second = paper_tables(result(3)).split("## SPL by position")
    assert rows(first)["VLFM"][:4] == ["44.92", "19.9", "57.34", "24.87"]
    assert rows(second)["OneMap, the paper's"][:3] == ["35.08", "37.44", "46.01"]
    assert rows(second)["**onemap, openclip**"][0] == "25.0 [0.0, 50.0]"


def test_of_other_lengths_nothing_is_quoted() -> None:
    text = paper_tables(result(4))
    assert "VLFM" not in text
    assert "SPL of object 4" in text


def test_a_metric_without_a_value_is_a_dash() -> None:
    empty = result(3)
    empty["metrics"]["spl_2"] = {"value": None, "low": None, "high": None}
    del empty["metrics"]["spl_3"]
    second = paper_tables(empty).split("## SPL by position")[1]
    assert rows(second)["**onemap, openclip**"][1:3] == ["-", "-"]


@pytest.mark.parametrize("quoted", [*SINGLE_OBJECT, *THREE_OBJECTS])
def test_every_quoted_figure_has_a_source_and_a_metric_of_ours(quoted: Any) -> None:
    ours = ratios_of([episode(0, *(found(name, 1.0, 1.0) for name in ("a", "b", "c")))])
    assert "arXiv" in quoted.source
    assert set(quoted.metrics) <= set(ours)
    assert all(0 < value < 100 for value in quoted.metrics.values())
