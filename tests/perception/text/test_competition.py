"""Scores of an encoder that brings no calibration."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_perception.config import SHIPPED
from onemap_perception.text.competition import Competition
from onemap_perception.text.embeddings import scores, unit_rows
from onemap_perception.text.vocabulary import load_table, load_vocabulary
from onemap_shared.geometry import F32
from onemap_shared.messages import TextEmbeddings

VOCABULARY, TABLE = load_vocabulary(SHIPPED), load_table(SHIPPED)
COMMON: F32 = unit_rows(np.random.default_rng(0).normal(size=(1, 384)).astype(np.float32))


def sharing(common: float) -> Callable[[Sequence[str]], F32]:
    """An encoder of texts all of which have a part in common, so long."""
    return lambda texts: unit_rows(TABLE.embed(texts) + np.float32(common) * COMMON)


def ask(*texts: str, common: float = 0.0, temperature: float | None = None) -> TextEmbeddings:
    embed = sharing(common)
    return Competition(VOCABULARY, embed, temperature).queries(
        texts, embed(texts), encoder_id="e", text_space="s", floor=0.0
    )


@given(common=st.floats(0, 3))
@settings(max_examples=10, deadline=None)
def test_what_all_texts_share_changes_no_score(common: float) -> None:
    """Cosines rise and lie closer together; shares of the words stay."""
    names = VOCABULARY.names
    plain = scores(sharing(0.0)(names), ask(*names))
    shared = scores(sharing(common)(names), ask(*names, common=common))
    assert (shared.argmax(axis=0) == np.arange(len(names))).all()
    np.testing.assert_allclose(np.diag(shared), np.diag(plain), atol=0.15)
    assert np.median(np.diag(shared)) > 20 * np.median(shared)


def test_synonyms_do_not_compete_and_mean_the_same() -> None:
    queries = ask("couch", "bucket", "sofa")
    assert queries.neutral_mask[:, 0].all()  # none of these
    sofa = [int(index) for index in np.flatnonzero(queries.neutral_mask[2] == 0)]
    assert set(sofa) <= set(np.flatnonzero(queries.neutral_mask[0] == 0))
    np.testing.assert_allclose(queries.neutral[sofa[0]], queries.embeddings[2], atol=1e-6)
    assert queries.same_meaning()[0].tolist() == [True, False, True]


def test_a_checkpoints_own_temperature_is_kept() -> None:
    assert ask("sofa", temperature=100.0).temperature == 100.0
    assert 18.1 < ask("sofa").temperature < 30  # mini's, fitted with labels, and not much more
    assert ask("sofa", common=1.2).temperature > 2 * ask("sofa").temperature


def test_the_controls_are_last_and_compete_with_each_other() -> None:
    queries = ask("sofa", common=1.2)
    controls = queries.neutral[-queries.controls :]
    asked = ask(*VOCABULARY.neutral, common=1.2)
    own = asked.embeddings @ controls.T > 1 - 1e-5
    assert 25 <= queries.controls == own.sum()
    assert (asked.neutral_mask[own.any(axis=1)] == 0).sum(axis=1).tolist() == [1] * queries.controls
