"""Batches are functions of seed and step, through all phases of the training."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_tools.train.data import batches
from onemap_tools.train.data.batches import BatchSource, class_frequency, named_targets
from onemap_tools.train.data.frame_dataset import NAMELESS, NO_CLASS
from tests.tools.train.tiny import tiny_frames, tiny_params

FRAMES = tiny_frames()


def test_batches_depend_on_seed_and_step_alone() -> None:
    source = BatchSource(FRAMES, tiny_params(seed=5, steps=4, batch_size=3))
    streamed = list(source.stream(2, 4))
    again = source.make(3)
    np.testing.assert_array_equal(streamed[1].rgb, again.rgb)
    np.testing.assert_array_equal(streamed[1].targets, again.targets)
    assert again.rgb.shape == (3, 48, 64, 3)
    assert again.targets.shape == (3 * 6 * 8, 3)
    assert not np.array_equal(streamed[0].rgb, again.rgb)
    other = BatchSource(FRAMES, tiny_params(seed=6, steps=4, batch_size=3))
    assert not np.array_equal(other.make(3).rgb, again.rgb)


def test_more_threads_make_the_same_batches_in_the_same_order() -> None:
    alone, together = (
        list(BatchSource(FRAMES, tiny_params(steps=6, batch_threads=threads)).stream(1, 6))
        for threads in (1, 3)
    )
    assert len(alone) == len(together) == 5
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_array_equal(one.rgb, other.rgb)


def test_each_phase_augments_in_its_own_way(monkeypatch: pytest.MonkeyPatch) -> None:
    used: list[str] = []
    for name in ("augment_strong", "augment_weak", "augment_full_image", "augment_camera"):
        real = getattr(batches, name)

        def noted(*arguments: object, name: str = name, real: object = real) -> object:
            used.append(name)
            return real(*arguments)  # type: ignore[operator]

        monkeypatch.setattr(batches, name, noted)
    params = tiny_params(steps=10, weak_share=0.5, batch_size=24)
    source = BatchSource(FRAMES, params)
    phases = []
    for step in (0, 4, 5, 9, 10):
        used.clear()
        batch = source.make(step)
        phases.append((len(batch.rgb), set(used)))
    strong, weak = {"augment_strong"}, {"augment_weak"}
    assert phases[:2] == [(24, strong)] * 2
    assert phases[2:4] == [(24, strong | weak)] * 2
    assert phases[4] == (12, {"augment_full_image", "augment_camera"})


def test_frequencies_are_shares_of_the_labelled_pixels() -> None:
    frequency = class_frequency(FRAMES)
    seen = FRAMES.label[:, ::4, ::4]
    labelled = seen[seen < 2]
    shares = [np.mean(labelled == 0), np.mean(labelled == 1), 0]
    np.testing.assert_allclose(frequency, shares, rtol=1e-6)


def test_things_without_a_name_are_the_last_target() -> None:
    label = np.full((1, 8, 16), NAMELESS, np.uint8)
    label[0, :4, :8], label[0, 4:, 8:] = 1, NO_CLASS
    np.testing.assert_allclose(named_targets(label, 2), [[0, 0.5, 0.5], [0, 0, 0.5]])
