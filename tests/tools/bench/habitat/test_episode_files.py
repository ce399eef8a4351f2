"""Episode files: layouts, order, goals, and what is refused in a sentence."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from onemap_tools.bench.habitat.episode_files import goals_of, parse_episodes, read_episodes
from tests.tools.bench.habitat.files import (
    SCENE_V1,
    SCENE_V2,
    index_file,
    multi_object,
    objectnav,
    write,
)

CONFIG_V1 = "./data/scene_datasets/hm3d/hm3d_annotated_basis.scene_dataset_config.json"


def test_an_objectnav_file_of_version_1() -> None:
    file = parse_episodes(objectnav(SCENE_V1, "chair", "tv_monitor", config=CONFIG_V1), "a file")
    first, second = file.episodes
    assert first.scene == SCENE_V1
    assert first.annotations == "hm3d/hm3d_annotated_basis.scene_dataset_config.json"
    assert first.start == (1.0, 0.2, -2.0)
    assert np.linalg.norm(first.rotation) == pytest.approx(1, abs=1e-12)
    assert (first.objects, second.objects) == (("chair",), ("tv_monitor",))
    goals = goals_of(file.goals, SCENE_V1, "tv_monitor")
    assert goals.object_ids == {7, 8}
    assert goals.view_points.shape == (4, 3)
    np.testing.assert_array_equal(goals.view_points[3], [2.5, 0.2, -4.0])


def test_the_paper_s_episodes_hold_sequences_and_no_goals() -> None:
    file = parse_episodes(multi_object(SCENE_V2, ["bed", "sofa", "toilet"]), "a file")
    (episode,) = file.episodes
    assert episode.objects == ("bed", "sofa", "toilet")
    assert file.goals == {}
    with pytest.raises(
        ValueError, match=r"no view point of 'bed' in HaxA7YrQdEC\.basis\.glb: give"
    ):
        goals_of(file.goals, episode.scene, "bed")


def changed(**values: Any) -> dict[str, Any]:
    document = deepcopy(objectnav(SCENE_V1, "chair"))
    document["episodes"][0].update(values)
    return document


@pytest.mark.parametrize(
    ("document", "complaint"),
    [
        ([], "f.gz: the document: .*; this is no file of ObjectNav"),
        ({"episodes": 3}, "f.gz: episodes: "),
        (changed(start_position=[0, 1]), r"f.gz: episodes\.0\.start_position"),
        (changed(start_position=[0, float("nan"), 0]), r"episodes\.0\.start_position\.1"),
        (
            changed(start_rotation=[0, 0, 0, 0]),
            r"f.gz: episodes\.0\.start_rotation: .* has length 0",
        ),
        (changed(object_category=None), r"f.gz: episodes\.0\.object_category"),
    ],
)
def test_what_is_no_episode_is_refused_with_its_place(document: Any, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint) as caught:
        parse_episodes(document, "f.gz")
    assert "\n" not in str(caught.value)


@pytest.fixture
def split(tmp_path: Path) -> Path:
    """A split as Habitat lays it out: an index and a file per scene."""
    folder = tmp_path / "objectnav" / "val"
    write(folder / "content" / "TEEsavR23oF.json.gz", objectnav(SCENE_V1, "chair", "bed"))
    write(folder / "content" / "HaxA7YrQdEC.json.gz", objectnav(SCENE_V2, "bed", "sofa"))
    write(folder / "val.json.gz", index_file())
    return folder


@pytest.fixture
def sequences(tmp_path: Path) -> Path:
    """The paper's episodes: a folder per scene."""
    folder = tmp_path / "multiobject_episodes"
    two = multi_object(SCENE_V2, ["bed", "sofa"], ["sofa", "bed"])
    write(folder / "00801-HaxA7YrQdEC" / "HaxA7YrQdEC_episodes.json.gz", two)
    one = multi_object(SCENE_V1, ["chair", "bed", "chair"])
    write(folder / "00800-TEEsavR23oF" / "TEEsavR23oF_episodes.json.gz", one)
    return folder


def test_sequences_get_their_goals_from_the_episodes_of_single_objects(
    split: Path, sequences: Path
) -> None:
    write(split / "content" / "OtherScene.json.gz", {"episodes": "not looked at"})
    found = read_episodes(sequences, split / "content", None)
    assert [each.index for each in found.episodes] == [0, 1, 2]
    assert [len(each.objects) for each in found.episodes] == [3, 2, 2]  # 00800 comes first
    assert len(found.goals["TEEsavR23oF.basis.glb", "chair"].view_points) == 4
    with pytest.raises(ValueError, match="give the ObjectNav episodes of the same scenes with"):
        read_episodes(sequences, None, None)


def test_what_cannot_be_read_is_refused_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="there is no file or folder"):
        read_episodes(tmp_path / "none", None, None)
    with pytest.raises(ValueError, match=r"holds no files \*\.json\.gz"):
        read_episodes(tmp_path, None, None)
    file = write(tmp_path / "a.json.gz", index_file())
    with pytest.raises(ValueError, match="holds no episode; of a split give the folder"):
        read_episodes(file, None, None)
