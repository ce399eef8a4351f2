"""Rendered frames: resumed, repeated and rendered by several processes."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from onemap_simulator.scene.scene import SceneObject
from onemap_tools.train.data.frame_dataset import (
    NAMELESS,
    NO_CLASS,
    FrameSetSpec,
    open_frames,
    render_frames,
)
from onemap_tools.train.variety.kinds import VALIDATION, VARIED
from onemap_tools.train.variety.strangers import STRANGER
from tests.simulator.scenes import box_room

SPEC = FrameSetSpec((901, 902), per_scene=2, width=32, height=24)
CLASSES = ("wall", "floor", "sofa")


@pytest.fixture
def _one_room(monkeypatch: pytest.MonkeyPatch) -> None:
    room = box_room()
    module = "onemap_tools.train.data.frame_dataset"
    monkeypatch.setattr(f"{module}.generate_apartment", lambda *_: room)
    objects = tuple(
        SceneObject(STRANGER) if thing.category == "sofa" else thing for thing in room.objects
    )
    varied = replace(room, objects=objects)
    monkeypatch.setattr(f"{module}.varied_scene", lambda *_: varied)


@pytest.mark.usefixtures("_one_room")
def test_an_interrupted_rendering_continues(tmp_path: Path) -> None:
    list(render_frames(tmp_path / "whole", CLASSES, SPEC))
    assert next(iter(render_frames(tmp_path / "halves", CLASSES, SPEC))) == 2
    assert len(open_frames(tmp_path / "halves")) == 2
    assert list(render_frames(tmp_path / "halves", CLASSES, SPEC)) == [4]
    whole, halves = open_frames(tmp_path / "whole"), open_frames(tmp_path / "halves")
    np.testing.assert_array_equal(whole.rgb, halves.rgb)
    np.testing.assert_array_equal(whole.label, halves.label)
    assert not np.array_equal(whole.rgb[:2], whole.rgb[2:])  # other seeds, other views
    assert (whole.scenes, whole.classes) == (2, CLASSES)


@pytest.mark.usefixtures("_one_room")
def test_labels_are_indices_of_the_classes(tmp_path: Path) -> None:
    list(render_frames(tmp_path, CLASSES, SPEC))
    every = np.unique(open_frames(tmp_path).label)
    assert {0, 1} <= set(every.tolist()) <= {0, 1, 2, NO_CLASS}
    list(render_frames(tmp_path / "none", ("piano",), SPEC))
    assert np.unique(open_frames(tmp_path / "none").label).tolist() == [NO_CLASS]


@pytest.mark.usefixtures("_one_room")
def test_a_share_of_the_apartments_is_varied_and_shows_things_without_a_name(
    tmp_path: Path,
) -> None:
    mixed = replace(SPEC, seeds=tuple(range(901, 921)), variety=VARIED, varied_share=0.5)
    varied = [mixed.variety_of(seed) is VARIED for seed in mixed.seeds]
    assert 4 <= sum(varied) <= 16
    assert mixed.variety_of(901) is replace(mixed, per_scene=9).variety_of(901)
    list(render_frames(tmp_path / "mixed", CLASSES, mixed))
    label = open_frames(tmp_path / "mixed").label
    for index, is_varied in enumerate(varied):
        shown = set(np.unique(label[2 * index : 2 * index + 2]).tolist())
        assert shown <= ({0, 1, NAMELESS, NO_CLASS} if is_varied else {0, 1, 2, NO_CLASS})
    assert (label == NAMELESS).any()


@pytest.mark.usefixtures("_one_room")
def test_frames_of_another_variety_are_refused(tmp_path: Path) -> None:
    list(render_frames(tmp_path, CLASSES, replace(SPEC, variety=VARIED)))
    for other in (SPEC, replace(SPEC, variety=VALIDATION)):
        with pytest.raises(ValueError, match="holds other frames than asked for, with vari"):
            list(render_frames(tmp_path, CLASSES, other))


@pytest.mark.usefixtures("_one_room")
def test_a_folder_with_other_frames_is_refused(tmp_path: Path) -> None:
    list(render_frames(tmp_path, CLASSES, SPEC))
    with pytest.raises(ValueError, match="with per_scene 2 rather than 3: choose another"):
        list(render_frames(tmp_path, CLASSES, replace(SPEC, per_scene=3)))
    many = replace(SPEC, seeds=tuple(range(901, 921)))
    with pytest.raises(ValueError, match=r"with seeds .901, 902. rather than 901 to 920 \(20\)"):
        list(render_frames(tmp_path, CLASSES, many))
    with pytest.raises(ValueError, match="with classes"):
        list(render_frames(tmp_path, CLASSES[:2], SPEC))
    with pytest.raises(FileNotFoundError, match="render them first"):
        open_frames(tmp_path / "nowhere")


@pytest.mark.usefixtures("_one_room")
def test_a_file_that_is_gone_is_named(tmp_path: Path) -> None:
    list(render_frames(tmp_path, CLASSES, SPEC))
    (tmp_path / "label.npy").unlink()
    with pytest.raises(FileNotFoundError, match=r"label\.npy is missing: remove"):
        open_frames(tmp_path)


def test_a_disk_without_room_is_refused_before_anything_is_rendered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = shutil.disk_usage(tmp_path)._replace(free=12_287)  # the frames take 12,288 bytes
    monkeypatch.setattr("shutil.disk_usage", lambda _: full)
    with pytest.raises(ValueError, match="GB of disk and"):
        next(render_frames(tmp_path, CLASSES, SPEC))
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_processes_render_the_same_frames(tmp_path: Path) -> None:
    for processes in (1, 2):
        done = render_frames(tmp_path / str(processes), CLASSES[:2], SPEC, processes)
        assert list(done) == [2, 4]
    alone, together = open_frames(tmp_path / "1"), open_frames(tmp_path / "2")
    np.testing.assert_array_equal(alone.rgb, together.rgb)
    np.testing.assert_array_equal(alone.label, together.label)
