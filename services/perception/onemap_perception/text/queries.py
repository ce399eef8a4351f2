"""What to compare a cell with when somebody asks for a word, and how to read the cosine.

The score of a word is its share in a softmax over itself and competing words: the
trained classes and some unrelated nouns. Competing means: not a synonym. A cell that
shows none of them well gives every unknown word a low share: the floor.
"""

from __future__ import annotations

import difflib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from onemap_perception.text.embedding_table import EmbeddingTable, plain
from onemap_perception.text.vocabulary import Vocabulary
from onemap_shared.geometry import F32, U8
from onemap_shared.messages import TextEmbeddings

CALIBRATION_FILE = "calibration.json"
SUGGESTED = 3  # words offered for one that has no place
SPELT_ALIKE = 0.75  # share of letters in common: one slip in a word of five letters
# From this share on a word that is not in the table is taken for a slip of one that is, whatever
# the sentence encoder makes of it: it places 'refridgerator' far from the refrigerator.
MISSPELT = 0.85


@dataclass(frozen=True, slots=True)
class Calibration:
    """Fitted on held-out apartments by ``onemap_tools.train``.

    temperature: factor of the cosine in the softmax; expansion: how much of the nearest
    classes' embedding is added to a query's own; sharpness: factor of the cosine when the
    nearest classes are weighted; synonym: from this cosine to the query on, a class or
    neutral word does not compete with it.

    floor: a best score below this means "not here"; measured by ``onemap bench queries``, 0: not
    measured. placed: a word whose cosine to every class is lower has no place among them; 0.45
    leaves out nine in ten random strings of letters and, of the held-out synonyms, only "telly".
    """

    temperature: float
    expansion: float
    sharpness: float
    synonym: float
    floor: float = 0.0
    placed: float = 0.0


class QueryEncoder:
    """Words to calibrated queries; immutable after construction.

    ``aliases`` False asks the embedding for the names in ``query_aliases`` too, to evaluate it.
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
        self._offered = self._words_with_a_place()

    def queries(self, texts: Sequence[str], *, encoder_id: str, text_space: str) -> TextEmbeddings:
        """Embeddings, competitors and temperature of these texts; raises UnknownWordError."""
        classes = [self._class_of(text) for text in texts]
        pairs = list(zip(texts, classes, strict=True))
        unknown = [
            text for text, named in pairs if named is None and not self._table.can_embed(text)
        ]
        if unknown:
            raise self._table.unknown_word_error(
                {text: self._spelt_alike(text) for text in unknown}
            )
        placed = [self._place(text, named) for text, named in pairs]
        return TextEmbeddings(
            encoder_id=encoder_id,
            text_space=text_space,
            texts=tuple(texts),
            embeddings=np.stack([embedding for embedding, _, _ in placed]),
            neutral=self._neutral,
            neutral_mask=np.stack([mask for _, mask, _ in placed]),
            temperature=self._calibration.temperature,
            floor=self._calibration.floor,
            nearest=tuple(nearest for _, _, nearest in placed),
        )

    def _class_of(self, text: str) -> int | None:
        """Index of the class that a text is a name of, None if of none."""
        word = plain(text)
        trained = self._vocabulary.class_of(word)
        if trained is None and self._aliases:
            return self._vocabulary.query_alias_of(word)
        return trained

    def _place(self, text: str, named: int | None) -> tuple[F32, U8, tuple[str, ...]]:
        """Embedding (D,), competitors (M,) and, if the text has no place, words near it."""
        if named is not None:
            competes = np.ones(len(self._neutral), np.uint8)
            competes[named] = 0
            return self._classes[named], competes, ()
        embedding: F32 = self._table.embed([text])[0]
        return self._expand(embedding), self._mask(embedding), self._nearest(text, embedding)

    def _nearest(self, text: str, embedding: F32) -> tuple[str, ...]:
        """Known words for a misspelt text or one far from every class, none for any other."""
        slips = () if self._table.contains(text) else self._spelt_alike(text, MISSPELT)
        if slips:
            return slips
        cosine = self._classes @ embedding
        if float(cosine.max()) >= self._calibration.placed:
            return ()
        meant = np.argsort(-cosine)[:SUGGESTED]
        return self._spelt_alike(text) or tuple(self._vocabulary.names[i] for i in meant)

    def _spelt_alike(self, text: str, share: float = SPELT_ALIKE) -> tuple[str, ...]:
        alike = difflib.get_close_matches(plain(text), self._offered, SUGGESTED, share)
        return tuple(word for word in alike if word != plain(text))

    def _words_with_a_place(self) -> tuple[str, ...]:
        """All that may be offered: the names of the classes and the words of the table near one."""
        words = self._table.words
        near = (self._table.embed(words) @ self._classes.T).max(axis=1) >= self._calibration.placed
        own = [word for word, is_near in zip(words, near, strict=True) if is_near]
        query_aliases = [word for entry in self._vocabulary.classes for word in entry.query_aliases]
        return tuple(dict.fromkeys([*own, *(query_aliases if self._aliases else ())]))

    def _expand(self, embedding: F32) -> F32:
        """The word leaning to its nearest classes.

        Rare words lie far from what the network learned; the lean is as strong as the likeness.
        """
        cosine = self._classes @ embedding
        weights = np.exp(self._calibration.sharpness * (cosine - cosine.max()))
        nearest = (weights / weights.sum()) @ self._classes
        return unit(embedding + np.float32(self._calibration.expansion) * unit(nearest))

    def _mask(self, embedding: F32) -> U8:
        """1 for every competing word (M,) uint8."""
        return (self._neutral @ embedding < self._calibration.synonym).astype(np.uint8)


def scores(features: F32, queries: TextEmbeddings) -> F32:
    """How surely each feature (P, D), unit rows, shows each text: (P, N) in [0, 1]."""
    cosines = features @ queries.embeddings.T
    if len(queries.neutral) == 0:
        plain_scores: F32 = (1 + cosines) / 2
        return plain_scores
    factor = np.float32(queries.temperature)
    wanted, rivals = factor * cosines, factor * (features @ queries.neutral.T)
    highest = np.maximum(wanted.max(axis=1), rivals.max(axis=1))[:, None]
    own = np.exp(wanted - highest)
    competing = np.exp(rivals - highest) @ queries.neutral_mask.T.astype(np.float32)
    shares: F32 = own / (own + competing)
    return shares


def unit(vector: F32) -> F32:
    """The vector (D,) at length one."""
    result: F32 = (vector / np.linalg.norm(vector)).astype(np.float32)
    return result


def load_calibration(folder: Path) -> Calibration:
    """Read ``calibration.json``; raises ValueError."""
    path = folder / CALIBRATION_FILE
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
        return Calibration(**{name: float(value) for name, value in values.items()})
    except (OSError, ValueError, TypeError, AttributeError) as problem:
        raise ValueError(f"cannot read the calibration {path}: {problem}") from problem


def save_calibration(folder: Path, calibration: Calibration) -> None:
    """Write ``calibration.json``."""
    text = json.dumps(asdict(calibration), indent=2) + "\n"
    (folder / CALIBRATION_FILE).write_text(text, encoding="utf-8")
