"""Scores of an encoder without labels: other words compete with each text.

A text's score is its share in a softmax over itself, the words that compete with it and the mean
of all, which stands for "none of these". What images and texts of one encoder have in common, high
cosines among them, weighs all of them alike.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_perception.text.embeddings import EmbedTexts, unit_rows
from onemap_perception.text.vocabulary import Vocabulary
from onemap_shared.geometry import F32, Bool
from onemap_shared.messages import TextEmbeddings

# Cosine, with the mean of all words taken off, from which two texts mean the same: as for mini.
SYNONYM = 0.7
# Standard deviation of the words' logits among each other where the checkpoint has no temperature:
# with that of mini, which is fitted with labels, it is 1.6, and 2.6 in its first 64 components.
# Places keep their order between 1.1 and 4.4.
LOGIT_SPREAD = 2.2
LEAST_SPREAD = 1e-6


class Competition:
    """The classes of a vocabulary and its neutral words; immutable.

    embed: texts to unit rows. temperature: None to fit it to the words.
    """

    def __init__(
        self, vocabulary: Vocabulary, embed: EmbedTexts, temperature: float | None = None
    ) -> None:
        words = embed((*vocabulary.names, *vocabulary.neutral))
        self._mean: F32 = words.mean(axis=0)
        alone = self._alike(words, words).sum(axis=1) == 1
        alone[: len(vocabulary.names)] = False
        order = np.argsort(alone, kind="stable")
        self._neutral = np.concatenate([unit_rows(self._mean[None]), words[order]])
        self._controls = int(alone.sum())
        cosines = (words @ words.T)[~np.eye(len(words), dtype=bool)]
        self.temperature = temperature or LOGIT_SPREAD / max(float(cosines.std()), LEAST_SPREAD)

    def queries(
        self, texts: Sequence[str], rows: F32, *, encoder_id: str, text_space: str, floor: float
    ) -> TextEmbeddings:
        """Queries of embeddings (N, D), unit rows. floor: 0: to be fitted to the map."""
        mask = ~self._alike(rows, self._neutral)
        mask[:, 0] = True
        return TextEmbeddings(
            encoder_id=encoder_id,
            text_space=text_space,
            texts=tuple(texts),
            embeddings=rows,
            neutral=self._neutral,
            neutral_mask=mask.astype(np.uint8),
            temperature=self.temperature,
            floor=floor,
            controls=self._controls,
        )

    def _alike(self, one: F32, other: F32) -> Bool:
        """Which texts (N, D) mean the same as which others (M, D): (N, M)."""
        first, second = (rows - self._mean for rows in (one, other))
        lengths = np.linalg.norm(first, axis=1)[:, None] * np.linalg.norm(second, axis=1)
        alike: Bool = first @ second.T >= SYNONYM * lengths
        return alike
