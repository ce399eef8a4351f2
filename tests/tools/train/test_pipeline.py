"""The steps of the training: what they need from each other, and what they write."""

from __future__ import annotations

import json
import shutil
from itertools import combinations
from pathlib import Path

import pytest

from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.text.vocabulary import FILE as VOCABULARY_FILE
from onemap_tools.train import pipeline
from onemap_tools.train.pipeline import TrainingError, TrainingFolders, frame_sets


def test_no_seed_occurs_in_two_sets_of_frames() -> None:
    sets = frame_sets(600, 20)
    for one, other in combinations(sets.values(), 2):
        assert not set(one.seeds) & set(other.seeds)
    assert (len(sets["train"].seeds), sets["train"].count) == (600, 12_000)


def test_words_of_the_output_folder_come_before_the_shipped_ones(tmp_path: Path) -> None:
    folders = TrainingFolders(tmp_path / "work", tmp_path / "out")
    shipped = folders.vocabulary
    folders.output.mkdir()
    shutil.copy(SHIPPED / VOCABULARY_FILE, folders.output)
    document = json.loads((folders.output / VOCABULARY_FILE).read_text(encoding="utf-8"))
    document["prompt"] = "only {}"
    (folders.output / VOCABULARY_FILE).write_text(json.dumps(document), encoding="utf-8")
    assert folders.vocabulary.prompt == "only {}"
    assert shipped.prompt != "only {}"


def test_a_step_without_its_frames_is_refused(tmp_path: Path) -> None:
    folders = TrainingFolders(tmp_path / "work", SHIPPED)
    with pytest.raises(TrainingError, match="render them first"):
        pipeline.evaluate_encoder(folders)
