"""Metrics and comparisons on hand-made results, and the folder that keeps them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from onemap_tools.bench.navigation import results


def found(name: str, shortest_m: float, driven_m: float) -> results.ObjectRecord:
    spl = shortest_m / max(shortest_m, driven_m)
    goal = (driven_m, shortest_m, 0.0)
    return results.ObjectRecord(
        name, "found", "", True, False, spl, *goal, 10.0, 5, 3, results.Failure.NONE
    )


def failed(name: str, driven_m: float, failure: results.Failure) -> results.ObjectRecord:
    wrong = failure is results.Failure.WRONG_OBJECT
    outcome = "found" if wrong else "not_found"
    return results.ObjectRecord(
        name, outcome, "", False, wrong, 0.0, driven_m, 2.0, None, 30.0, 0, 0, failure
    )


def episode(index: int, *objects: results.ObjectRecord, contacts: int = 0) -> results.EpisodeRecord:
    path = ((1.0, 2.0), (1.5, 2.25))
    return results.EpisodeRecord(
        index,
        index + 1,
        (1.0, 2.0, 0.5),
        objects,
        contacts,
        trajectory=path,
        wall_s=1.0,
        start_m=index + 1.5,
    )


ALL = episode(0, found("bed", 4, 8), found("sofa", 2, 2), found("desk", 3, 4), contacts=2)
TWO = episode(
    1, found("bed", 2, 2), found("sofa", 3, 6), failed("fan", 4, results.Failure.WRONG_OBJECT)
)
GAP = episode(
    2, failed("bed", 9, results.Failure.NEVER_IN_VIEW), found("sofa", 1, 2), found("fan", 1, 1)
)
FIRST, SECOND = episode(0, found("bed", 4, 8)), episode(1, found("fan", 1, 1))
OPTIONS: dict[str, Any] = {"method": "onemap", "seed": 1, "config": {"planner": {"plan_hz": 4.0}}}


def test_metrics_are_those_of_habitat_and_of_the_paper() -> None:
    values = {
        name: each["value"] for name, each in results.estimates([ALL, TWO, GAP], seed=1).items()
    }
    assert values == pytest.approx(
        {
            "sr": 7 / 9,
            "spl": (0.5 + 1 + 0.75 + 1 + 0.5 + 0.5 + 1) / 9,
            "wrong_claims": 1 / 9,
            "path_m": 38 / 9,
            "time_s": 130 / 9,
            "sequence_sr": 1 / 3,  # all of it was found
            "sequence_spl": 9 / 14 / 3,
            "pr": (1 + 2 / 3 + 0) / 3,  # progress ends with the first failure
            # The path to the wrong object counts, what came before it was on the shortest.
            "ppl": (9 / 14 + 2 / 3 * 5 / 12) / 3,
            "contacts": 2 / 3,
            "start_m": (1.5 + 2.5 + 3.5) / 3,
            "spl_1": (0.5 + 1 + 0) / 3,
            "spl_2": (1 + 0.5) / 2,  # given that all before were found
            "spl_3": (0.75 + 0) / 2,
            "spl_third_over_first": 0.375 / 0.5,
        },
        abs=1e-4,
    )
    document = results.summary([ALL, TWO, GAP], seed=1)
    assert (document["episodes"], document["objects"], document["contacts"]) == (3, 9, 2)
    counted = {reason: count for reason, count in document["failures"].items() if count}
    assert counted == {"wrong object claimed": 1, "never in view": 1}
    json.dumps(document, allow_nan=False)
    assert document == results.summary([ALL, TWO, GAP], seed=1)
    nothing = results.estimates(
        [episode(0, failed("bed", 1, results.Failure.STUCK), found("sofa", 1, 1))], seed=1
    )
    assert nothing["spl_2"]["value"] is None
    assert str(results.Estimate(**nothing["spl_2"])) == "-"


def test_intervals_cover_the_truth_about_as_often_as_they_say() -> None:
    rng, covered = np.random.default_rng(3), 0
    for trial in range(200):
        share = results.resampling(60, trial) @ (rng.random(60) < 0.7) / 60
        estimate = results.Estimate.of(np.array([0.7, *share[1:]]))
        assert estimate.low is not None
        assert estimate.high is not None
        covered += estimate.low <= 0.7 <= estimate.high
    assert 0.88 <= covered / 200 <= 0.99


def test_pairs_have_narrow_intervals() -> None:
    good = [episode(k, found("bed", 4, 4 + k), found("sofa", 2, 2)) for k in range(4)]
    # Half as efficient in each apartment, and the second object wrong in the first of them.
    poor = [episode(k, found("bed", 4, 2 * (4 + k)), found("sofa", 2, 4)) for k in (1, 2, 3)]
    poor.append(episode(0, found("bed", 4, 8), failed("sofa", 3, results.Failure.WRONG_OBJECT)))
    compared = results.comparison(good, poor, seed=1)
    assert compared["spl_1"] == {"value": 2.0, "low": 2.0, "high": 2.0}
    assert compared["spl_2"]["value"] == pytest.approx(1 / (1.5 / 4), abs=1e-3)
    assert compared["sr"]["value"] == pytest.approx(1 / 8)
    assert compared["wrong_claims"]["value"] == pytest.approx(-1 / 8)
    assert "spl_3" not in compared
    with pytest.raises(ValueError, match="no apartment in common"):
        results.comparison(good, [episode(9, found("bed", 1, 1))], seed=1)


def test_finished_episodes_are_kept_and_a_cut_off_line_is_not(tmp_path: Path) -> None:
    out = tmp_path / "runs" / "one"
    folder = results.ResultsFolder(out, OPTIONS)
    assert folder.finished == []
    stairwells = ((1.0, 2.0, 1.5, 3.0),)
    for record in (SECOND, replace(TWO, index=0, stairwells=stairwells, people_touched=2)):
        folder.add(record)
    file = out / "episodes.jsonl"
    file.write_text(file.read_text() + json.dumps(FIRST.document())[:50])
    again = results.ResultsFolder(out, OPTIONS)
    assert again.finished == [
        SECOND,
        replace(TWO, index=0, stairwells=stairwells, people_touched=2),
    ]
    again.add(episode(2, found("sofa", 1, 2)))
    assert len(results.ResultsFolder(out, OPTIONS).finished) == 3
    compared = {"spl": {"value": 0.5, "low": 0.25, "high": 0.75}}
    document = {
        **{"method": "<vlfm>", "features": "mini", "errors": "people", "stairwells_per_episode": 2},
        **results.summary(again.finished, 1),
        "compared_with": {"<oracle>": {"metrics": {}, "compared": compared}},
    }
    lines = [" ".join(line.split()) for line in results.table_lines(document)]
    for line in (
        "method <vlfm>",
        "people_touched 2",
        "edges_crossed 0",
        "failed: wrong object claimed 1",
        f"sr {results.Estimate(**document['metrics']['sr'])}",
        "spl over that of <oracle> 0.500 [0.250, 0.750]",
    ):
        assert line in lines
    again.write_results(document)
    assert json.loads((out / "results.json").read_text()) == document


def test_a_folder_of_other_options_is_refused_in_a_sentence(tmp_path: Path) -> None:
    results.ResultsFolder(tmp_path, OPTIONS)
    with pytest.raises(ValueError, match="holds results with seed 1 instead of 2: choose another"):
        results.ResultsFolder(tmp_path, {**OPTIONS, "seed": 2})
    with pytest.raises(ValueError, match=r"config\.planner\.plan_hz 4\.0 instead of 5\.0"):
        results.ResultsFolder(tmp_path, {**OPTIONS, "config": {"planner": {"plan_hz": 5.0}}})
    (tmp_path / "options.json").write_text("{")
    with pytest.raises(ValueError, match="is damaged"):
        results.ResultsFolder(tmp_path, OPTIONS)


def test_only_runs_of_the_same_task_are_compared(tmp_path: Path) -> None:
    results.ResultsFolder(tmp_path, OPTIONS).add(FIRST)
    assert results.read_beside(tmp_path, {**OPTIONS, "method": "vlfm"}) == ("onemap", [FIRST])
    other = {**OPTIONS, "config": {"planner": {"plan_hz": 5.0}}}
    assert results.read_beside(tmp_path, other) == ("onemap, planner.plan_hz 4.0", [FIRST])
    later = {"seed": 3, "config": {**OPTIONS["config"], "simulator": {"seed": 3}}}
    assert results.read_beside(tmp_path, {**OPTIONS, **later})[0] == "onemap"
    with pytest.raises(ValueError, match=r"simulator\.rgbd_hz None instead of 8\.0: only runs"):
        results.read_beside(tmp_path, {**other, "config": {"simulator": {"rgbd_hz": 8.0}}})
    with pytest.raises(ValueError, match="holds no results"):
        results.read_beside(tmp_path / "none", OPTIONS)
