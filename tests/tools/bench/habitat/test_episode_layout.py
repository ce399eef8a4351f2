"""Layouts of episode files: what is taken, and what is refused in a sentence."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
import pytest

from onemap_tools.bench.habitat.episode_layout import goals_of, parse_episodes
from tests.tools.bench.habitat.files import (
    SCENE_V1,
    SCENE_V2,
    index_file,
    multi_object,
    objectnav,
)

CONFIG_V1 = "./data/scene_datasets/hm3d/hm3d_annotated_basis.scene_dataset_config.json"


def test_an_objectnav_file_of_version_1() -> None:
    file = parse_episodes(objectnav(SCENE_V1, "chair", "tv_monitor", config=CONFIG_V1), "a file")
    first, second = file.episodes
    assert (first.index, second.index) == (0, 1)
    assert first.scene == SCENE_V1
    assert first.scene_config == "hm3d/hm3d_annotated_basis.scene_dataset_config.json"
    assert first.start == (1.0, 0.2, -2.0)
    assert np.linalg.norm(first.rotation) == pytest.approx(1, abs=1e-12)
    assert (first.objects, second.objects) == (("chair",), ("tv_monitor",))
    goals = goals_of(file.goals, SCENE_V1, "tv_monitor")
    assert goals.object_ids == {7, 8}
    assert goals.view_points.shape == (4, 3)
    np.testing.assert_array_equal(goals.view_points[3], [2.5, 0.2, -4.0])


def test_version_2_may_name_scenes_from_the_working_directory() -> None:
    plain = "hm3d_v0.2/hm3d_basis.scene_dataset_config.json"
    document = objectnav("data/scene_datasets/" + SCENE_V2, "plant", config=plain)
    (episode,) = parse_episodes(document, "a file").episodes
    assert episode.scene == SCENE_V2
    assert episode.scene_config == "hm3d_v0.2/hm3d_annotated_basis.scene_dataset_config.json"


def test_the_paper_s_episodes_hold_sequences_and_no_goals() -> None:
    file = parse_episodes(multi_object(SCENE_V2, ["bed", "sofa", "toilet"]), "a file")
    (episode,) = file.episodes
    assert episode.objects == ("bed", "sofa", "toilet")
    assert file.goals == {}
    with pytest.raises(
        ValueError, match=r"no view point of 'bed' in HaxA7YrQdEC\.basis\.glb: give"
    ):
        goals_of(file.goals, episode.scene, "bed")


def test_an_index_holds_no_episode() -> None:
    assert parse_episodes(index_file(), "val.json.gz").episodes == ()


def test_goals_without_a_scene_in_their_name_belong_to_none() -> None:
    document = objectnav(SCENE_V1, "chair")
    document["goals_by_category"] = {"chair": []}
    assert ("chair", "") in parse_episodes(document, "a file").goals


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
        (changed(start_position=[0, 1e6, 0]), r"episodes\.0\.start_position\.1"),
        (changed(start_rotation=[0, 0, 0, 0]), "f.gz: episode 0 has a start_rotation of length 0"),
        (changed(object_category=None), "episode 0 has neither object_category nor object_goals"),
        (changed(scene_id="../../etc/passwd"), "a scene lies below the folder of scenes"),
        (changed(scene_id="./"), "a scene lies below the folder of scenes"),
        (changed(scene_id="/etc/passwd"), "a scene lies below the folder of scenes"),
        (
            changed(scene_dataset_config="../annotated.json"),
            "a scene lies below the folder of scenes",
        ),
        (changed(object_goals=["chair"] * 21), r"episodes\.0\.object_goals"),
    ],
)
def test_what_is_no_episode_is_refused_with_its_place(document: Any, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint) as caught:
        parse_episodes(document, "f.gz")
    assert "\n" not in str(caught.value)
