"""``onemap train`` at the command line."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import torch
from typer.testing import CliRunner

import onemap_tools.train
from onemap_tools.train.commands import app, summary_lines
from onemap_tools.train.params import TrainParams
from onemap_tools.train.rounds import TrainingRound
from onemap_tools.train.train_state import TrainState
from tests.tools.train.tiny import tiny_params


def test_a_step_without_its_frames_says_which_step_comes_first(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["train", "--work", str(tmp_path)])
    assert result.exit_code == 2
    assert "render them first" in result.output


def test_a_missing_package_is_named_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "onemap_tools.train.pipeline", raising=False)
    monkeypatch.delattr(onemap_tools.train, "pipeline", raising=False)
    monkeypatch.setitem(sys.modules, "onnx", None)
    monkeypatch.delitem(sys.modules, "onemap_tools.export.mini", raising=False)
    result = CliRunner().invoke(app, ["export", "--work", str(tmp_path)])
    assert result.exit_code == 2
    assert "Training needs the package 'onnx': pip install 'onemap[train]'" in result.output


def test_missing_weights_are_named_before_anything_is_rendered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("onnx")
    monkeypatch.setattr("onemap_tools.train.pipeline._open_sentence_encoder", lambda: None)
    monkeypatch.setattr("onemap_tools.train.pipeline.find_backbone_weights", lambda: None)
    result = CliRunner().invoke(app, ["mini", "--work", str(tmp_path / "work")])
    assert result.exit_code == 2
    assert "requirements-train.txt" in result.output
    assert not (tmp_path / "work").exists()


def test_a_training_does_not_start_from_itself(tmp_path: Path) -> None:
    pytest.importorskip("onnx")
    arguments = ["--work", str(tmp_path), "--start-from", str(tmp_path / "run")]
    for command in ("mini", "train"):
        result = CliRunner().invoke(app, [command, *arguments])
        assert result.exit_code == 2
        assert "move it" in result.output


def test_a_further_round_learns_more_slowly(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("onnx")
    (tmp_path / "first").mkdir()
    one = TrainingRound(steps=3, seed=0, pictures=6, apartments=1, frozen_stride=0)
    TrainState(tiny_params(), one, torch.device("cpu")).save(tmp_path / "first")
    given: list[TrainParams] = []
    monkeypatch.setattr(
        "onemap_tools.train.pipeline.train", lambda _, params, *__: given.append(params)
    )
    for further in ([], ["--start-from", str(tmp_path / "first")]):
        arguments = ["train", "--work", str(tmp_path / "work"), "--steps", "3", *further]
        assert CliRunner().invoke(app, arguments).exit_code == 0
    anew, again = given
    assert (anew.start_from, again.start_from) == (None, tmp_path / "first")
    assert again.learning_rate < anew.learning_rate
    assert (
        again.model_copy(update={"start_from": None, "learning_rate": anew.learning_rate}) == anew
    )


@pytest.mark.parametrize("command", ["mini", "train"])
def test_a_training_does_not_start_from_nothing(tmp_path: Path, command: str) -> None:
    pytest.importorskip("onnx")
    arguments = ["--work", str(tmp_path / "work"), "--start-from", str(tmp_path / "typo")]
    result = CliRunner().invoke(app, [command, *arguments])
    assert result.exit_code == 2
    assert "holds no checkpoint" in result.output
    assert not (tmp_path / "work").exists()


def test_a_device_that_is_none_is_named_before_anything_is_rendered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("onnx")
    monkeypatch.setattr("onemap_tools.train.pipeline.find_pretrained", lambda: None)
    arguments = ["mini", "--work", str(tmp_path / "work"), "--device", "gpu"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2
    assert "device 'gpu' cannot be used" in result.output
    assert not (tmp_path / "work").exists()


def test_a_work_folder_that_is_a_file_is_named(tmp_path: Path) -> None:
    pytest.importorskip("onnx")
    (tmp_path / "work").write_text("")
    result = CliRunner().invoke(app, ["render", "--work", str(tmp_path / "work")])
    assert result.exit_code == 2
    assert "work" in result.output
    assert "Traceback" not in result.output


def test_the_summary_names_the_worst_words() -> None:
    words = {
        "r_precision": 0.5,
        "auroc_mean_over_words": 0.75,
        "auroc_pooled": 0.7,
        "r_precision_by_word": {f"word{i}": i / 20 for i in range(20)},
    }
    part = {
        "frames": 2,
        "classes": 3,
        "pixel_accuracy": 0.9,
        "miou": 0.6,
        "calibration_error": 0.02,
        "detector": {"precision": 0.8, "recall": 0.4},
        "best_answer": {"calibration_error": 0.125, "sure": 0.75, "wrong_of_sure": 0.25},
        "names": words,
        "held_out_aliases": words,
    }
    sets = dict.fromkeys(("held_out", "other_style", "validation"), part)
    lines = list(summary_lines({"encoder_id": "mini-1", **sets}))
    assert lines[0] == "encoder mini-1"
    assert "held_out: 2 frames, 3 classes" in lines
    assert "best answers: calibration error 0.125" in lines[3]
    assert "    worst: word0 0.00" in lines[6]
    assert "word7 0.35" in lines[6]
    assert "word8" not in lines[6]
