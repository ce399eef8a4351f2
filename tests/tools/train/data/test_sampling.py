"""Frames of rare classes and of hard pairs are drawn more often."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_tools.train.data.frame_dataset import NAMELESS, NO_CLASS, FrameDataset
from onemap_tools.train.data.sampling import BLOCK, frame_probabilities, shown_classes
from tests.tools.train.tiny import tiny_params

CLASSES = ("wall", "door", "wardrobe", "cup")


def frames_of(*shown: int) -> FrameDataset:
    """One frame for each label, in the middle of a wall."""
    label = np.zeros((len(shown), 48, 64), np.uint8)
    label[:, 8:40, 8:56] = np.array(shown, np.uint8)[:, None, None]
    return FrameDataset(np.zeros((*label.shape, 3), np.uint8), label, CLASSES)


def test_pixels_are_counted_by_class_over_several_blocks() -> None:
    shown = [0, 1, NAMELESS, NO_CLASS] * (BLOCK // 3)
    counts = shown_classes(frames_of(*shown))
    assert counts.shape == (len(shown), 5)
    inner, total = 8 * 12, 12 * 16
    np.testing.assert_array_equal(counts[0], [total, 0, 0, 0, 0])
    np.testing.assert_array_equal(counts[1], [total - inner, inner, 0, 0, 0])
    np.testing.assert_array_equal(counts[2], [total - inner, 0, 0, 0, inner])
    np.testing.assert_array_equal(counts[3], [total - inner, 0, 0, 0, 0])
    np.testing.assert_array_equal(counts[-4:], counts[:4])


def test_a_frame_with_a_rare_class_is_drawn_more_often() -> None:
    frames = frames_of(*[0] * 12, *[1] * 3, 3)
    params = tiny_params(hard_pairs=(), rare_power=0.5)
    chances = frame_probabilities(frames, params)
    assert chances.sum() == pytest.approx(1)
    # Walls are in all 16 frames, doors in three, a cup in one.
    assert chances[12] / chances[0] == pytest.approx((16 / 3) ** 0.5)
    assert chances[15] / chances[0] == pytest.approx(4)
    even = frame_probabilities(frames, tiny_params(hard_pairs=(), rare_power=0))
    np.testing.assert_allclose(even, 1 / 16)


def test_a_frame_with_one_of_a_hard_pair_is_drawn_more_often() -> None:
    frames = frames_of(0, 0, 1, 2, 3)
    params = tiny_params(
        rare_power=0, hard_share=0.5, hard_pairs=(("wardrobe", "door"), ("cup", "piano"))
    )
    chances = frame_probabilities(frames, params) * 6.5
    np.testing.assert_allclose(chances, [1, 1, 1.5, 1.5, 1.5])
    # A pair with the wall does not mark all frames that show a wall.
    params = tiny_params(rare_power=0, hard_share=0.5, hard_pairs=(("wardrobe", "wall"),))
    np.testing.assert_allclose(frame_probabilities(frames, params) * 5.5, [1, 1, 1, 1.5, 1])
