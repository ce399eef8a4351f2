"""Training data: frames on disk, their augmentation, batches and class texts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_shared.geometry import U8
from onemap_tools.train.augmentation import augment_strong, augment_weak
from onemap_tools.train.batches import BatchSource
from onemap_tools.train.frames import (
    NO_CLASS,
    FrameDataset,
    FrameSetSpec,
    open_frames,
    render_frames,
)
from tests.simulator.scenes import box_room
from tests.tools.processes.pickling_pool import PicklingPool
from tests.tools.train.tiny import tiny_frames, tiny_params

FRAMES = tiny_frames()
SPEC = FrameSetSpec((901, 902), per_scene=2, width=32, height=24)
CLASSES = ("wall", "floor", "sofa")
Augmentation = Callable[[U8, U8, tuple[int, int], np.random.Generator], tuple[U8, U8]]


@pytest.fixture
def _one_room(monkeypatch: pytest.MonkeyPatch) -> None:
    room = box_room()
    monkeypatch.setattr("onemap_tools.train.frames.generate_apartment", lambda *_: room)
    monkeypatch.setattr("onemap_tools.train.frames.worker_pool", PicklingPool)


def check_same_frames(one: FrameDataset, other: FrameDataset) -> None:
    assert len(one) == len(other)
    for number in range(len(one)):
        for mine, theirs in zip(one[number], other[number], strict=True):
            np.testing.assert_array_equal(mine, theirs)


@pytest.mark.usefixtures("_one_room")
def test_an_interrupted_rendering_continues(tmp_path: Path) -> None:
    list(render_frames(tmp_path / "whole", CLASSES, SPEC))
    assert next(iter(render_frames(tmp_path / "halves", CLASSES, SPEC))) == 2
    assert len(open_frames(tmp_path / "halves")) == 2
    assert list(render_frames(tmp_path / "halves", CLASSES, SPEC)) == [4]
    whole, halves = open_frames(tmp_path / "whole"), open_frames(tmp_path / "halves")
    check_same_frames(whole, halves)
    assert not np.array_equal(whole[0][0], whole[2][0])  # other seeds, other views
    assert (len(whole.images), whole.classes) == (2, CLASSES)


@pytest.mark.usefixtures("_one_room")
def test_several_processes_render_the_same_frames(tmp_path: Path) -> None:
    for processes in (1, 2):
        done = render_frames(tmp_path / str(processes), CLASSES[:2], SPEC, processes)
        assert list(done) == [2, 4]
    check_same_frames(open_frames(tmp_path / "1"), open_frames(tmp_path / "2"))


@pytest.mark.usefixtures("_one_room")
def test_a_folder_with_other_frames_is_refused(tmp_path: Path) -> None:
    list(render_frames(tmp_path, CLASSES, SPEC))
    with pytest.raises(ValueError, match="with other per_scene: choose another"):
        list(render_frames(tmp_path, CLASSES, replace(SPEC, per_scene=3)))
    with pytest.raises(ValueError, match="with other classes"):
        list(render_frames(tmp_path, CLASSES[:2], SPEC))
    with pytest.raises(FileNotFoundError, match="render them first"):
        open_frames(tmp_path / "nowhere")


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
@pytest.mark.parametrize("augment", [augment_strong, augment_weak])
def test_size_and_labels_are_kept(augment: Augmentation, seed: int) -> None:
    frame, shown = FRAMES[0]
    rgb, label = augment(frame, shown, (64, 48), np.random.default_rng(seed))
    np.testing.assert_array_equal(frame, FRAMES[0][0])  # the frame itself is not changed
    assert rgb.shape == (48, 64, 3)
    assert rgb.dtype == label.dtype == np.uint8
    assert label.shape == (48, 64)
    assert set(np.unique(label).tolist()) <= {0, 1, NO_CLASS}


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_weakly_augmented_labels_lie_where_the_image_shows_the_thing(seed: int) -> None:
    rgb, label = augment_weak(*FRAMES[0], (64, 48), np.random.default_rng(seed))
    kernel = np.ones((5, 5), np.uint8)
    inside = cv2.erode(label, kernel) == cv2.dilate(label, kernel)  # away from edges
    known = (inside & (label != NO_CLASS))[2:-2, 2:-2]
    bright, sofa = rgb[2:-2, 2:-2, 0] > 120, label[2:-2, 2:-2] == 1
    np.testing.assert_array_equal(bright[known], sofa[known])


def test_batches_depend_on_seed_and_step_alone() -> None:
    source = BatchSource(FRAMES, tiny_params(seed=5, steps=4, batch_size=3))
    streamed = list(source.stream(2, 4))
    again = source.make(3)
    np.testing.assert_array_equal(streamed[1].rgb, again.rgb)
    np.testing.assert_array_equal(streamed[1].targets, again.targets)
    assert again.rgb.shape == (3, 48, 64, 3)
    assert again.targets.shape == (3 * 6 * 8, 2)
    assert not np.array_equal(streamed[0].rgb, again.rgb)
    other = BatchSource(FRAMES, tiny_params(seed=6, steps=4, batch_size=3))
    assert not np.array_equal(other.make(3).rgb, again.rgb)
