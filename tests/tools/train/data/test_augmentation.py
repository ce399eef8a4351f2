"""Augmented images keep their size, their labels, and the match between them."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_shared.geometry import U8
from onemap_tools.train.data.augmentation import augment_full_image, augment_strong, augment_weak
from onemap_tools.train.data.frame_dataset import NO_CLASS
from tests.tools.train.tiny import tiny_frames

FRAMES = tiny_frames()
Augmentation = Callable[[U8, U8, tuple[int, int], np.random.Generator], tuple[U8, U8]]


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
@pytest.mark.parametrize("augment", [augment_strong, augment_weak])
def test_size_and_labels_are_kept(augment: Augmentation, seed: int) -> None:
    rgb, label = augment(FRAMES.rgb[0], FRAMES.label[0], (64, 48), np.random.default_rng(seed))
    assert rgb.shape == (48, 64, 3)
    assert rgb.dtype == label.dtype == np.uint8
    assert label.shape == (48, 64)
    assert set(np.unique(label).tolist()) <= {0, 1, NO_CLASS}


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_weakly_augmented_labels_lie_where_the_image_shows_the_thing(seed: int) -> None:
    rgb, label = augment_weak(FRAMES.rgb[0], FRAMES.label[0], (64, 48), np.random.default_rng(seed))
    kernel = np.ones((5, 5), np.uint8)
    inside = cv2.erode(label, kernel) == cv2.dilate(label, kernel)  # away from edges
    known = (inside & (label != NO_CLASS))[2:-2, 2:-2]
    bright, sofa = rgb[2:-2, 2:-2, 0] > 120, label[2:-2, 2:-2] == 1
    np.testing.assert_array_equal(bright[known], sofa[known])


def test_a_whole_image_is_mirrored_with_its_labels_or_not_at_all() -> None:
    rgb, label = FRAMES.rgb[0], FRAMES.label[0]
    mirrored = []
    for seed in range(8):
        image, labels = augment_full_image(rgb, label, np.random.default_rng(seed))
        mirrored.append(bool(np.array_equal(labels, label[:, ::-1])))
        assert mirrored[-1] or np.array_equal(labels, label)
        expected = rgb[:, ::-1] if mirrored[-1] else rgb
        ratio = image.mean(axis=2) / expected.mean(axis=2)
        assert 0.84 < np.median(ratio) < 1.16
        assert ratio.std() < 0.1
    assert set(mirrored) == {True, False}


@pytest.mark.parametrize("augment", [augment_strong, augment_weak])
def test_the_frame_itself_is_not_changed(augment: Augmentation) -> None:
    rgb, label = FRAMES.rgb[1].copy(), FRAMES.label[1].copy()
    for seed in range(10):
        augment(rgb, label, (64, 48), np.random.default_rng(seed))
    np.testing.assert_array_equal(rgb, FRAMES.rgb[1])
    np.testing.assert_array_equal(label, FRAMES.label[1])
