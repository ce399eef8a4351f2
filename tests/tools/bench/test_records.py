"""Metrics and comparisons on hand-made results, and the folder that keeps them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from onemap_tools.bench.navigation.records import (
    Estimate,
    Failure,
    Ratio,
    _weights,
    comparison,
    episode_record,
    estimates,
    progress_by_path_length,
    sequence_spl,
    summary,
)
from onemap_tools.bench.navigation.results import ResultsFolder, paths_of, read_beside, table_lines
from tests.tools.bench.records import episode, failed, found

ALL = episode(0, found("bed", 4, 8), found("sofa", 2, 2), found("desk", 3, 4), contacts=2)
TWO = episode(1, found("bed", 2, 2), found("sofa", 3, 6), failed("fan", 4, Failure.WRONG_OBJECT))
GAP = episode(2, failed("bed", 9, Failure.NEVER_IN_VIEW), found("sofa", 1, 2), found("fan", 1, 1))
GOOD = [episode(k, found("bed", 4, 4 + k), found("sofa", 2, 2)) for k in range(4)]
# Half as efficient in each apartment, and the second object wrong in the first of them.
POOR = [
    episode(0, found("bed", 4, 8), failed("sofa", 3, Failure.WRONG_OBJECT)),
    *[episode(k, found("bed", 4, 2 * (4 + k)), found("sofa", 2, 4)) for k in (1, 2, 3)],
]
RECORD = episode(3, found("bed", 4, 8), failed("fan", 2, Failure.NOT_DETECTED), contacts=1)
OPTIONS: dict[str, Any] = {"method": "onemap", "seed": 1, "config": {"planner": {"plan_hz": 4.0}}}
FIRST, SECOND = episode(0, found("bed", 4, 8)), episode(1, found("fan", 1, 1))
WALK = replace(
    episode(0, found("bed", 1, 1), found("fan", 1, 1)),
    trajectory=tuple((float(x), 0.0) for x in range(9)),
)


def values() -> dict[str, float | None]:
    return {name: each.value for name, each in estimates([ALL, TWO, GAP], seed=1).items()}


def test_success_and_spl_per_object_are_means_over_all_objects() -> None:
    assert values()["sr"] == pytest.approx(7 / 9, abs=1e-4)
    spl = 0.5 + 1 + 0.75 + 1 + 0.5 + 0.5 + 1
    assert values()["spl"] == pytest.approx(spl / 9, abs=1e-4)
    assert values()["wrong_claims"] == pytest.approx(1 / 9, abs=1e-4)
    assert values()["path_m"] == pytest.approx(38 / 9, abs=1e-4)


def test_a_sequence_counts_if_all_of_it_was_found() -> None:
    assert values()["sequence_sr"] == pytest.approx(1 / 3, abs=1e-4)
    assert sequence_spl(ALL) == pytest.approx(9 / 14)
    assert sequence_spl(TWO) == 0.0


def test_progress_ends_with_the_first_failure() -> None:
    assert values()["pr"] == pytest.approx((1 + 2 / 3 + 0) / 3, abs=1e-4)
    # The path to the wrong object counts, what came before it was found on the shortest.
    assert progress_by_path_length(TWO) == pytest.approx(2 / 3 * 5 / 12)
    assert progress_by_path_length(GAP) == 0.0


def test_spl_by_position_is_given_that_all_before_were_found() -> None:
    assert values()["spl_1"] == pytest.approx((0.5 + 1 + 0) / 3, abs=1e-4)
    assert values()["spl_2"] == pytest.approx((1 + 0.5) / 2, abs=1e-4)
    assert values()["spl_3"] == pytest.approx((0.75 + 0) / 2, abs=1e-4)
    assert values()["spl_third_over_first"] == pytest.approx(0.375 / 0.5, abs=1e-4)


def test_the_summary_counts_the_reasons_and_is_json() -> None:
    document = summary([ALL, TWO, GAP], seed=1)
    assert (document["episodes"], document["objects"], document["contacts"]) == (3, 9, 2)
    assert document["failures"][Failure.WRONG_OBJECT.value] == 1
    assert document["failures"][Failure.NEVER_IN_VIEW.value] == 1
    assert sum(document["failures"].values()) == 2
    json.dumps(document, allow_nan=False)
    assert document == summary([ALL, TWO, GAP], seed=1)


def test_without_a_case_there_is_no_value() -> None:
    single = estimates([episode(0, failed("bed", 1, Failure.STUCK), found("sofa", 1, 1))], seed=1)
    assert single["spl_2"].value is None
    assert str(single["spl_2"]) == "-"
    assert "spl_3" not in single


def test_intervals_cover_the_truth_about_as_often_as_they_say() -> None:
    rng, covered = np.random.default_rng(3), 0
    for trial in range(200):
        ratio = Ratio((rng.random(60) < 0.7).astype(float), np.ones(60))
        found_share = Estimate.of(ratio.of(_weights(60, trial)[0]), 0.7)
        assert found_share.low is not None
        assert found_share.high is not None
        covered += found_share.low <= 0.7 <= found_share.high
    assert 0.88 <= covered / 200 <= 0.99


def test_pairs_have_narrow_intervals() -> None:
    compared = comparison(GOOD, POOR, seed=1)
    first = compared["spl_1"]
    assert (first.value, first.low, first.high) == (2.0, 2.0, 2.0)
    assert compared["spl_2"].value == pytest.approx(1 / (1.5 / 4), abs=1e-3)
    assert compared["sr"].value == pytest.approx(1 / 8)
    assert compared["wrong_claims"].value == pytest.approx(-1 / 8)
    assert "spl_3" not in compared


def test_a_record_survives_its_json_line() -> None:
    assert episode_record(json.loads(json.dumps(RECORD.document(), allow_nan=False))) == RECORD


@pytest.mark.parametrize("changed", [{"objects": [{}]}, {"start": [1]}, {"more": 1}])
def test_other_documents_are_refused(changed: dict[str, object]) -> None:
    with pytest.raises((ValueError, KeyError, TypeError)):
        episode_record({**RECORD.document(), **changed})


def test_finished_episodes_are_kept_and_a_cut_off_line_is_not(tmp_path: Path) -> None:
    out = tmp_path / "runs" / "one"
    folder = ResultsFolder(out, OPTIONS)
    assert folder.finished == []
    folder.add(SECOND)
    folder.add(FIRST)
    file = out / "episodes.jsonl"
    file.write_text(file.read_text() + json.dumps(FIRST.document())[:50])
    again = ResultsFolder(out, OPTIONS)
    assert again.finished == [SECOND, FIRST]
    again.add(episode(2, found("sofa", 1, 2)))
    assert len(ResultsFolder(out, OPTIONS).finished) == 3
    opened = replace(FIRST, stairwells=((1.0, 2.0, 1.5, 3.0),), people_touched=2)
    compared = {"spl": {"value": 0.5, "low": 0.25, "high": 0.75}}
    document = {
        **{"method": "<vlfm>", "features": "mini", "errors": "people", "stairwells_per_episode": 2},
        **summary([opened, SECOND], 1),
        "compared_with": {"<oracle>": {"metrics": {}, "compared": compared}},
    }
    lines = table_lines(document)
    assert lines[0].startswith("<vlfm>, mini features, errors: people, 2 stairwells: 2 episodes")
    for line in (
        "contacts with people, all episodes     2",
        "stairwells, all episodes               1",
        "wheels over an edge, all episodes      0",
    ):
        assert line in lines
    assert not any("loop closures" in line for line in lines)
    (out / "episode_0001.png").touch()
    again.write_results(document, again.finished)
    assert json.loads((out / "results.json").read_text()) == document
    page = (out / "index.html").read_text()
    assert "&lt;vlfm&gt;, mini features" in page
    assert "episode_0001.png" in page
    assert "episode_0000.png" not in page  # no such picture
    assert "SPL per object, over that of &lt;oracle&gt;" in page


def test_a_folder_of_other_options_is_refused_in_a_sentence(tmp_path: Path) -> None:
    ResultsFolder(tmp_path, OPTIONS)
    with pytest.raises(ValueError, match="holds results with seed 1 instead of 2: choose another"):
        ResultsFolder(tmp_path, {**OPTIONS, "seed": 2})
    with pytest.raises(ValueError, match=r"config\.planner\.plan_hz 4\.0 instead of 5\.0"):
        ResultsFolder(tmp_path, {**OPTIONS, "config": {"planner": {"plan_hz": 5.0}}})
    (tmp_path / "options.json").write_text("{")
    with pytest.raises(ValueError, match="is damaged"):
        ResultsFolder(tmp_path, OPTIONS)


def test_only_runs_of_the_same_task_are_compared(tmp_path: Path) -> None:
    ResultsFolder(tmp_path, OPTIONS).add(FIRST)
    assert read_beside(tmp_path, {**OPTIONS, "method": "vlfm"}) == ("onemap", [FIRST])
    other = {**OPTIONS, "config": {"planner": {"plan_hz": 5.0}}}
    assert read_beside(tmp_path, other) == ("onemap, planner.plan_hz 4.0", [FIRST])
    later = {"seed": 3, "config": {**OPTIONS["config"], "simulator": {"seed": 3}}}
    assert read_beside(tmp_path, {**OPTIONS, **later})[0] == "onemap"
    with pytest.raises(ValueError, match=r"simulator\.rgbd_hz None instead of 8\.0: only runs"):
        read_beside(tmp_path, {**other, "config": {"simulator": {"rgbd_hz": 8.0}}})
    with pytest.raises(ValueError, match="features None instead of 'mini': only runs"):
        read_beside(tmp_path, {**other, "features": "mini"})
    with pytest.raises(ValueError, match="holds no results"):
        read_beside(tmp_path / "none", OPTIONS)


def test_the_trajectory_is_cut_where_the_next_object_begins() -> None:
    first, second = paths_of(WALK)
    np.testing.assert_array_equal(first[:, 0], range(5))
    np.testing.assert_array_equal(second[:, 0], range(4, 9))
    assert paths_of(replace(WALK, trajectory=())) == []
