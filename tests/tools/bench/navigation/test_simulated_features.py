"""The simulated encoder: what it says without errors, and how large the errors are."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.text.embedding_table import load_table
from onemap_perception.text.scores import scores
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_simulator.rendering.label_renderer import label_colours
from onemap_tools.bench.navigation.simulated_features import (
    UNCALIBRATED,
    SimulatedEncoder,
    SimulatedFeatureParams,
    compact_table,
    label_shares,
)
from tests.tools.bench.navigation.test_episodes import room

EXACT = SimulatedFeatureParams(noise=0.0, object_noise=0.0, confusion=0.0, blur_patches=0.0)
BED, DESK = 2, 3  # objects of the room
LABELS = np.repeat(np.array([[BED, DESK, -1]], np.int32), 8, axis=0).repeat(8, axis=1)


def encoder(params: SimulatedFeatureParams, seed: int = 1) -> SimulatedEncoder:
    return SimulatedEncoder(room(), SHIPPED, params, np.random.default_rng(seed))


def score(simulated: SimulatedEncoder, word: str) -> np.ndarray:
    """(h, w) scores of the patches of ``LABELS``."""
    features = simulated.encode(label_colours(LABELS)).astype(np.float32)
    flat = scores(features.reshape(-1, features.shape[-1]), simulated.embed_text((word,)))
    return flat.reshape(features.shape[:2])


def test_without_errors_every_patch_is_its_object_s_word() -> None:
    beds = score(encoder(EXACT), "bed")
    assert beds.shape == (2, 6)
    assert beds[:, :2].min() > 0.9
    assert beds[:, 2:].max() < 0.1


def test_with_errors_most_patches_still_are_and_a_seed_repeats_them() -> None:
    beds = score(encoder(SimulatedFeatureParams(confusion=0.0)), "bed")
    assert beds[:, 0].mean() > 0.3 > beds[:, 3].mean()
    np.testing.assert_array_equal(
        beds, score(encoder(SimulatedFeatureParams(confusion=0.0)), "bed")
    )
    assert not np.array_equal(
        beds, score(encoder(SimulatedFeatureParams(confusion=0.0), seed=2), "bed")
    )


def test_a_confused_object_looks_like_another_of_the_scene() -> None:
    wrong = encoder(EXACT.model_copy(update={"confusion": 1.0}))
    assert score(wrong, "bed")[:, :2].max() < 0.5
    assert score(wrong, "wall").max() < 0.999


def test_uncalibrated_scores_are_all_high_and_close() -> None:
    simulated = encoder(UNCALIBRATED)
    queries = simulated.embed_text(("bed", "toilet"))
    assert len(queries.neutral) == 0
    assert not queries.same_meaning()[0, 1]
    beds = score(simulated, "bed")[:, :4]
    assert beds.min() > 0.5
    assert 0.02 < beds[:, 0].mean() - beds[:, 3].mean() < 0.3
    assert simulated.encoder_id != encoder(EXACT).encoder_id


def test_fewer_dimensions_keep_the_cosines_of_the_classes() -> None:
    vocabulary, table = load_vocabulary(SHIPPED), load_table(SHIPPED)
    rows = table.embed(vocabulary.names)
    few = compact_table(table, vocabulary, SimulatedFeatureParams().dimension)
    small = few.embed(vocabulary.names)
    assert small.shape[1] == SimulatedFeatureParams().dimension
    changes = np.abs(small @ small.T - rows @ rows.T)
    assert (changes.mean() < 0.03, changes.max() < 0.11) == (True, True)


def test_shares_of_labels_per_patch() -> None:
    labels = np.array([[0, 0, 1, -1], [0, 1, 1, -1]], np.int32)
    np.testing.assert_allclose(label_shares(labels, 2, 2), [[[0.75, 0.25], [0.0, 0.5]]])
    assert label_shares(labels, 2, 3).sum() == pytest.approx(1.5)
