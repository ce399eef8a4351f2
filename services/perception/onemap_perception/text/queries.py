"""Texts to calibrated queries of the encoder ``mini``.

The score of a text is its share in a softmax over itself and competing words: the trained
classes and some unrelated nouns, without the text's synonyms. An unknown word gets a low share
wherever a class fits well.
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence

import numpy as np

from onemap_perception.text.vocabulary import Calibration, EmbeddingTable, Vocabulary
from onemap_shared.geometry import F32, U8
from onemap_shared.messages import TextEmbeddings
from onemap_shared.names import normalised

MAX_SUGGESTIONS = 3  # words suggested for an unknown one
SIMILAR_SPELLING = 0.75  # share of letters in common: one typing error in a word of five letters
# From this share on, a word outside the table counts as a misspelling of one inside, whatever its
# embedding: the sentence encoder places 'refridgerator' far from the refrigerator.
MISSPELLING = 0.85
IMAGE_NAME = "image"  # stands for the text where an image is asked for


class QueryEncoder:
    """Texts to queries; immutable after construction.

    aliases: answer ``query_aliases`` as their class; False, to evaluate the embedding alone.
    """

    def __init__(
        self,
        vocabulary: Vocabulary,
        table: EmbeddingTable,
        calibration: Calibration,
        *,
        aliases: bool = True,
    ) -> None:
        self._vocabulary = vocabulary
        self._table = table
        self._calibration = calibration
        self._aliases = aliases
        self._classes = np.stack(
            [unit(table.embed(entry.aliases).mean(axis=0)) for entry in vocabulary.classes]
        )
        self._neutral = np.concatenate([self._classes, table.embed(vocabulary.neutral)])
        self._suggestible = self._suggestible_words()

    def queries(self, texts: Sequence[str], *, encoder_id: str, text_space: str) -> TextEmbeddings:
        """Embeddings, competing words and temperature of these texts; raises UnknownWordError."""
        classes = [self._class_of(text) for text in texts]
        pairs = list(zip(texts, classes, strict=True))
        unknown = [
            text for text, index in pairs if index is None and not self._table.can_embed(text)
        ]
        if unknown:
            raise self._table.unknown_word_error(
                {text: self._spelt_alike(text) for text in unknown}
            )
        foreign = [text for text, index in pairs if index is None]
        rows = dict(zip(foreign, self._table.embed(foreign), strict=True)) if foreign else {}
        queries = [
            self._foreign_query(text, rows[text]) if index is None else self._class_query(index)
            for text, index in pairs
        ]
        return TextEmbeddings(
            encoder_id=encoder_id,
            text_space=text_space,
            texts=tuple(texts),
            embeddings=np.stack([embedding for embedding, _, _ in queries]),
            neutral=self._neutral,
            neutral_mask=np.stack([mask for _, mask, _ in queries]),
            temperature=self._calibration.temperature,
            floor=self._calibration.floor,
            nearest=tuple(nearest for _, _, nearest in queries),
        )

    def vector_query(self, vector: F32, *, encoder_id: str, text_space: str) -> TextEmbeddings:
        """The query of a unit vector (D,) that is no text's, as of a picture; its floor is 0.

        As a text that names no class: drawn to the classes that it is like, which do not compete.
        """
        return TextEmbeddings(
            encoder_id=encoder_id,
            text_space=text_space,
            texts=(IMAGE_NAME,),
            embeddings=self._expand(vector)[None],
            neutral=self._neutral,
            neutral_mask=self._mask(vector)[None],
            temperature=self._calibration.temperature,
        )

    def _class_of(self, text: str) -> int | None:
        """Index of the class that the text is a name of, None if of none."""
        word = normalised(text)
        trained = self._vocabulary.class_of(word)
        if trained is None and self._aliases:
            return self._vocabulary.query_alias_of(word)
        return trained

    def _class_query(self, index: int) -> tuple[F32, U8, tuple[str, ...]]:
        """Embedding (D,), mask of competing words (M,) uint8 and suggestions of a class."""
        competes = np.ones(len(self._neutral), np.uint8)
        competes[index] = 0
        return self._classes[index], competes, ()

    def _foreign_query(self, text: str, embedding: F32) -> tuple[F32, U8, tuple[str, ...]]:
        """The same of a text that names no class, from its own embedding (D,)."""
        return self._expand(embedding), self._mask(embedding), self._suggest(text, embedding)

    def _suggest(self, text: str, embedding: F32) -> tuple[str, ...]:
        """Known words for a misspelt text or one unlike every class; none for any other."""
        meant = () if self._table.contains(text) else self._spelt_alike(text, MISSPELLING)
        if meant:
            return meant
        cosine = self._classes @ embedding
        if float(cosine.max()) >= self._calibration.placed:
            return ()
        nearest = np.argsort(-cosine)[:MAX_SUGGESTIONS]
        return self._spelt_alike(text) or tuple(self._vocabulary.names[i] for i in nearest)

    def _spelt_alike(self, text: str, share: float = SIMILAR_SPELLING) -> tuple[str, ...]:
        word = normalised(text)
        alike = difflib.get_close_matches(word, self._suggestible, MAX_SUGGESTIONS, share)
        return tuple(other for other in alike if other != word)

    def _suggestible_words(self) -> tuple[str, ...]:
        """The table's words that are like some class, and the aliases."""
        words = self._table.words
        near = (self._table.embed(words) @ self._classes.T).max(axis=1) >= self._calibration.placed
        own = [word for word, is_near in zip(words, near, strict=True) if is_near]
        aliases = [word for entry in self._vocabulary.classes for word in entry.query_aliases]
        return tuple(dict.fromkeys([*own, *(aliases if self._aliases else ())]))

    def _expand(self, embedding: F32) -> F32:
        """The embedding (D,) plus a mean of the classes, weighted by their cosine to it.

        Rare words lie far from what the network was trained on.
        """
        cosine = self._classes @ embedding
        weights = np.exp(self._calibration.sharpness * (cosine - cosine.max()))
        nearest = (weights / weights.sum()) @ self._classes
        return unit(embedding + np.float32(self._calibration.expansion) * unit(nearest))

    def _mask(self, embedding: F32) -> U8:
        """1 for every competing word (M,) uint8, 0 for synonyms."""
        return (self._neutral @ embedding < self._calibration.synonym).astype(np.uint8)


def unit(vector: F32) -> F32:
    """The vector (D,) scaled to length one."""
    result: F32 = (vector / np.linalg.norm(vector)).astype(np.float32)
    return result
