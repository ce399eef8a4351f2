"""A killed run goes on, a folder of other options is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from onemap_tools.bench.navigation.results_folder import ResultsFolder, read_beside
from tests.tools.bench.navigation.records import episode, found

OPTIONS: dict[str, Any] = {"method": "onemap", "seed": 1, "config": {"planner": {"plan_hz": 4.0}}}
FIRST, SECOND = episode(0, found("bed", 4, 8)), episode(1, found("fan", 1, 1))


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
    metrics = {"spl_1": {"value": 0.5, "low": 0.25, "high": 0.75}}
    how: dict[str, object] = {"errors": "none"}
    how |= dict.fromkeys(("episodes", "objects_per_episode", "seed", "apartments", "style"), 1)
    document = {"method": "<vlfm>", "features": "mini", **how, "metrics": metrics, "failures": {}}
    document["compared_with"] = {
        "<oracle>": {"metrics": metrics, "compared": {"spl": metrics["spl_1"]}}
    }
    again.write_results(document, again.finished)
    assert json.loads((out / "results.json").read_text()) == document
    page = (out / "index.html").read_text()
    assert "&lt;vlfm&gt;, mini features" in page
    assert "episode_0001.png" in page
    assert "0.500 [0.250, 0.750]" in page
    assert "SPL per object, over that of &lt;oracle&gt;" in page
    plot = ElementTree.fromstring((out / "spl_by_position.svg").read_text())
    labels = [each.text for each in plot.iter("{http://www.w3.org/2000/svg}text")]
    assert labels[-4:] == ["1", "<vlfm>", "1", "<oracle>"]


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
