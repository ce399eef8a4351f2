"""Augmented images keep their size, their labels, and the match between them."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_shared.geometry import U8
from onemap_tools.train.data import augmentation
from onemap_tools.train.data.augmentation import (
    augment_camera,
    augment_full_image,
    augment_strong,
    augment_weak,
)
from onemap_tools.train.data.frame_dataset import NAMELESS, NO_CLASS
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


def test_another_camera_sees_the_same_labels_or_their_mirror_image() -> None:
    rgb, label = FRAMES.rgb[0], FRAMES.label[0]
    looks = set()
    for seed in range(8):
        image, labels = augment_camera(rgb, label, np.random.default_rng(seed))
        assert np.array_equal(labels, label) or np.array_equal(labels, label[:, ::-1])
        assert image.shape == rgb.shape
        assert image.dtype == np.uint8
        looks.add(int(image.mean()))
    assert len(looks) > 4


def test_a_lens_bends_picture_and_labels_alike() -> None:
    label = np.zeros((96, 128), np.uint8)
    label[::8], label[:, ::8] = 1, 1
    label = cv2.dilate(label, np.ones((3, 3), np.uint8)).astype(np.uint8)
    rgb = np.repeat((label * 200)[..., None], 3, axis=2).astype(np.uint8)
    bent = 0
    for seed in range(6):
        image, labels = augmentation._through_lens(rgb, label, np.random.default_rng(seed))
        known = labels != NO_CLASS
        assert known.mean() > 0.9
        agree = (image[..., 0] > 100) == (labels == 1)
        assert agree[known].mean() > 0.9
        bent += int((labels != label)[known].mean() > 0.05)
    assert bent >= 3


def test_classes_are_recoloured_apart_and_unlabelled_pixels_stay() -> None:
    label = np.array([[0, 1], [NAMELESS, NO_CLASS]], np.uint8).repeat(24, 0).repeat(32, 1)
    image = np.full((48, 64, 3), (120, 90, 60), np.float32)
    ratios = []
    for seed in range(10):
        result = augmentation._recolour_classes(image, label, np.random.default_rng(seed))
        np.testing.assert_array_equal(result[label == NO_CLASS], image[label == NO_CLASS])
        assert (result[label == NAMELESS] != image[label == NAMELESS]).any()
        ratios.append([float(result[label == index].mean()) for index in (0, 1)])
    assert np.ptp(np.array(ratios), axis=0).min() > 10
    assert np.abs(np.diff(ratios, axis=1)).max() > 10


@pytest.mark.parametrize("augment", [augment_strong, augment_weak])
def test_the_frame_itself_is_not_changed(augment: Augmentation) -> None:
    rgb, label = FRAMES.rgb[1].copy(), FRAMES.label[1].copy()
    for seed in range(10):
        augment(rgb, label, (64, 48), np.random.default_rng(seed))
    np.testing.assert_array_equal(rgb, FRAMES.rgb[1])
    np.testing.assert_array_equal(label, FRAMES.label[1])
