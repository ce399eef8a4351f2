"""The steps of the training: what they need from each other, and what they write."""

from __future__ import annotations

import json
import shutil
import sys
from itertools import combinations
from pathlib import Path

import pytest
import torch
from typer.testing import CliRunner

import onemap_tools.train
from onemap_perception.config import MiniParams
from onemap_perception.encoders.mini import NETWORK_FILE, MiniEncoder
from onemap_perception.text.vocabulary import load_calibration
from onemap_tools.train import pipeline
from onemap_tools.train.commands import app
from onemap_tools.train.evaluation import figures_table
from onemap_tools.train.frames import FrameSetSpec
from onemap_tools.train.network import Backbone
from onemap_tools.train.pipeline import frame_sets
from onemap_tools.train.trainer import TrainingRecord, TrainState
from tests.simulator.scenes import box_room
from tests.tools.processes.pickling_pool import PicklingPool
from tests.tools.train.tiny import embed, published, tiny_frames, tiny_params


def test_no_seed_occurs_in_two_sets_of_frames() -> None:
    sets = frame_sets(600)
    for one, other in combinations(sets.values(), 2):
        assert not set(one.seeds) & set(other.seeds)
    assert (len(sets["train"].seeds), sets["train"].count) == (600, 12_000)


def test_an_export_that_fails_leaves_the_encoder_that_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    work, output = tmp_path / "work", tmp_path / "encoder"
    output.mkdir()
    before = b"weights of before"
    (output / NETWORK_FILE).write_bytes(before)
    state = TrainState(tiny_params(), TrainingRecord(3, 0, 6, 1), torch.device("cpu"))
    (work / "run").mkdir(parents=True)
    state.save(work / "run")
    monkeypatch.setattr(pipeline, "open_frames", lambda *_: tiny_frames())
    monkeypatch.setattr(pipeline, "compare_with_torch", lambda *_: float("nan"))
    with pytest.raises(ValueError, match="least cosine nan"):
        pipeline.export(work, output)
    assert [path.name for path in output.iterdir()] == [NETWORK_FILE]
    assert (output / NETWORK_FILE).read_bytes() == before


@pytest.mark.slow
def test_all_steps_make_an_encoder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = ("held_out", "other_style", "calibrate", "train")
    specs = {name: FrameSetSpec((901 + i,), per_scene=2) for i, name in enumerate(names)}
    monkeypatch.setattr(pipeline, "frame_sets", lambda *_: specs)
    frames = "onemap_tools.train.frames"
    monkeypatch.setattr(f"{frames}.generate_apartment", lambda *_: box_room())  # else two seconds
    monkeypatch.setattr(f"{frames}.worker_pool", PicklingPool)  # else it is not this room
    weights = published(Backbone(), tmp_path / "weights.pth")
    monkeypatch.setattr(pipeline, "find_pretrained", lambda: (weights, embed))
    monkeypatch.setattr(pipeline, "_open_sentence_encoder", lambda: embed)  # else 20 s
    monkeypatch.setattr(pipeline, "keep_freed_memory", lambda: None)  # for this process's sake
    work, output = tmp_path / "work", tmp_path / "encoder"
    pipeline.render(work, 1, 1)
    pipeline.train(work, tiny_params(), "cpu", 1)
    assert pipeline.export(work, output) > 0.999
    assert (output / NETWORK_FILE).stat().st_size < 12 * 2**20
    assert not list(output.glob(".export-*"))
    assert load_calibration(output).floor == 0  # measured by another command
    shutil.rmtree(work / "train")  # only the training needs them
    figures = pipeline.evaluate_encoder(work, output)
    assert figures["encoder_id"] == MiniEncoder(MiniParams(folder=output)).encoder_id
    assert figures["held_out"]["frames"] == figures["other_style"]["frames"] == 2
    assert figures_table(figures).endswith("| images | 2 | 2 |")
    record = json.loads((output / pipeline.TRAINING_FILE).read_text(encoding="utf-8"))
    assert record == {"steps": 3, "seed": 0, "pictures": 2, "apartments": 1}


def invoked(*arguments: object) -> str:
    """What a command says that cannot be done."""
    result = CliRunner().invoke(app, [str(each) for each in arguments])
    assert result.exit_code == 2
    assert "Traceback" not in result.output
    return result.output


def test_what_a_step_lacks_is_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    work = tmp_path / "work"
    assert "are missing: correct" in invoked("evaluate", "--work", work)
    monkeypatch.setattr(pipeline, "find_model_folder", lambda: None)
    assert "needs the sentence encoder" in invoked("mini", "--work", work)
    monkeypatch.setattr(pipeline, "_open_sentence_encoder", lambda: embed)
    monkeypatch.setattr(pipeline, "find_backbone_weights", lambda: None)
    assert "requirements/train.txt" in invoked("mini", "--work", work)
    monkeypatch.setattr(pipeline, "find_pretrained", lambda: None)
    sentence = invoked("mini", "--work", work, "--device", "gpu")
    assert "device 'gpu' cannot be used" in sentence
    assert not work.exists()  # before anything is rendered
    work.write_text("")
    assert "work" in invoked("mini", "--work", work)


def test_a_missing_package_is_named_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "onemap_tools.train.pipeline", raising=False)
    monkeypatch.delattr(onemap_tools.train, "pipeline", raising=False)
    monkeypatch.setitem(sys.modules, "onnx", None)
    monkeypatch.delitem(sys.modules, "onemap_tools.train.export", raising=False)
    said = invoked("evaluate", "--work", tmp_path)
    assert "Training needs the package 'onnx': pip install -e '.[train]'" in said
