"""Texts to calibrated queries of the encoder ``mini``.

The score of a text is its share in a softmax over itself and competing words: the trained
classes and some unrelated nouns, without the text's synonyms. A word that is like no class is
refused, since the network was trained to see nothing like it.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from onemap_perception.errors import UnknownWordError
from onemap_perception.text.vocabulary import (
    Calibration,
    EmbeddingTable,
    Vocabulary,
    named_words,
)
from onemap_shared.geometry import F32, I64, U8
from onemap_shared.messages import TextEmbeddings
from onemap_shared.names import normalised
from onemap_shared.sentence import is_description

MAX_SUGGESTIONS = 3  # words suggested for an unknown one
SIMILAR_SPELLING = 0.75  # share of letters in common: one typing error in a word of five letters
# From this share on, a word outside the table counts as a misspelling of one inside, whatever its
# embedding: the sentence encoder places 'refridgerator' far from the refrigerator.
MISSPELLING = 0.85
# Cosine to a class from which a word counts as one, though nobody knows it: of random strings 1 in
# 100 reaches it ("placed", which admits what is known to be a word, 1 in 5).
LIKE_A_CLASS = 0.55
ANYTHING = re.compile(r"^anything\b", re.I)
IMAGE_NAME = "image"  # stands for the text where an image is asked for


class QueryEncoder:
    """Texts to queries; immutable after construction.

    knows: whether a word that is not in the table is one at all; None: the table alone is known.
    raw: neither answer ``query_aliases`` as their class nor refuse what is like no class, to
    evaluate the embedding alone.
    """

    def __init__(
        self,
        vocabulary: Vocabulary,
        table: EmbeddingTable,
        calibration: Calibration,
        *,
        knows: Callable[[str], bool] | None = None,
        raw: bool = False,
    ) -> None:
        self._vocabulary = vocabulary
        self._table = table
        self._calibration = calibration
        self._knows = knows
        self._raw = raw
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
            text
            for text, index in pairs
            if index is None and not self._table.can_embed(_embedded(text))
        ]
        if unknown:
            raise self._table.unknown_word_error(
                {text: self._spelt_alike(text) for text in unknown}
            )
        foreign = [text for text, index in pairs if index is None]
        embedded = self._table.embed([_embedded(text) for text in foreign]) if foreign else ()
        rows = dict(zip(foreign, embedded, strict=True))
        if not self._raw:
            self._refuse_unlike(rows)
        queries = [
            self._foreign_query(text, rows[text]) if index is None else self._class_query(index)
            for text, index in pairs
        ]
        nearest = [
            self._nearest(rows[text]).tolist() if index is None else [index]
            for text, index in pairs
        ]
        return TextEmbeddings(
            encoder_id=encoder_id,
            text_space=text_space,
            texts=tuple(texts),
            embeddings=np.stack([embedding for embedding, _ in queries]),
            neutral=self._neutral,
            neutral_mask=np.stack([mask for _, mask in queries]),
            temperature=self._calibration.temperature,
            floor=self._calibration.floor,
            stands_for=tuple(tuple(self._vocabulary.names[i] for i in each) for each in nearest),
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
        if trained is None and not self._raw:
            return self._vocabulary.query_alias_of(word)
        return trained

    def _class_query(self, index: int) -> tuple[F32, U8]:
        """Embedding (D,) and mask of competing words (M,) uint8 of a class."""
        competes = np.ones(len(self._neutral), np.uint8)
        competes[index] = 0
        return self._classes[index], competes

    def _foreign_query(self, text: str, embedding: F32) -> tuple[F32, U8]:
        """The same of a text that names no class, from its own embedding (D,).

        The classes that a description stands for do not compete with it, though none is near.
        """
        mask = self._mask(embedding)
        if is_description(text):
            mask[self._nearest(embedding)] = 0
        return self._expand(embedding), mask

    def _nearest(self, embedding: F32) -> I64:
        """Indices (3,) of the classes that are most like an embedding (D,), the nearest first."""
        return np.argsort(-(self._classes @ embedding), kind="stable")[:MAX_SUGGESTIONS]

    def _refuse_unlike(self, rows: Mapping[str, F32]) -> None:
        """UnknownWordError about all texts, with embeddings (D,), that are misspelt or unlike every
        class, or hold what is no word; with known words that are spelt alike, where the text
        itself is no word."""
        unlike: dict[str, tuple[str, ...]] = {}
        holding: dict[str, tuple[str, ...]] = {}  # texts that hold what is no word
        no_words: dict[str, tuple[str, ...]] = {}
        for text, embedding in rows.items():
            word = self._table.contains(text)
            near = () if word else self._spelt_alike(text, MISSPELLING)
            if near or float((self._classes @ embedding).max()) < self._calibration.placed:
                unlike[text] = near or (() if word else self._spelt_alike(text))
            elif words := self._no_words(text):
                holding[text] = self._spelt_alike(text)
                no_words |= {word: self._spelt_alike(word) for word in words}
        sentences = []
        if unlike:
            named, are = named_words(unlike)
            sentences.append(
                f"{named} {are} like nothing that this encoder was trained to see: words must be "
                "English"
            )
        if holding:
            named, are = named_words(no_words)
            sentences.append(
                f"{named} {are} no word that this encoder knows: name the thing without it"
            )
        if sentences:
            raise UnknownWordError("; ".join(sentences), unlike | holding)

    def _no_words(self, text: str) -> list[str]:
        """The parts of a text that are no words: "asdf" of "asdf chair"."""
        if self._knows is None or self._table.contains(text):
            return []
        words = re.findall(r"[^\W\d_]{2,}", normalised(text))
        asked = [word for word in words if not self._table.contains(word) and not self._knows(word)]
        if not asked:
            return []
        like = (self._table.embed(asked) @ self._classes.T).max(axis=1)
        return [word for word, cosine in zip(asked, like, strict=True) if cosine < LIKE_A_CLASS]

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
        return tuple(dict.fromkeys([*own, *aliases]))

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


def _embedded(text: str) -> str:
    """The text whose embedding is taken: "anything to sit on" asks for what "something" does, but
    of 56 such pairs the sentence encoder answers 34 with other names."""
    return ANYTHING.sub("something", text) if is_description(text) else text


def unit(vector: F32) -> F32:
    """The vector (D,) scaled to length one."""
    result: F32 = (vector / np.linalg.norm(vector)).astype(np.float32)
    return result
