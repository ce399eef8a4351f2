"""What to compare a cell with when somebody asks for a word, and how to read the cosine.

The score of a word is its share in a softmax over itself and competing words: the
trained classes and some unrelated nouns. Competing means: not a synonym. A cell that
shows none of them well gives every unknown word a low share: the floor.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from onemap_perception.vocabulary import Vocabulary
from onemap_perception.words import WordTable, plain
from onemap_shared.geometry import F32, U8
from onemap_shared.messages import TextEmbeddings

CALIBRATION_FILE = "calibration.json"


@dataclass(frozen=True, slots=True)
class Calibration:
    """Fitted on held-out apartments by ``onemap_tools.train``.

    temperature: factor of the cosine in the softmax; expansion: how much of the nearest
    classes' embedding is added to a query's own; sharpness: factor of the cosine when the
    nearest classes are weighted; synonym: from this cosine to the query on, a class or
    neutral word does not compete with it.
    """

    temperature: float
    expansion: float
    sharpness: float
    synonym: float


class QueryText:
    """Words to calibrated queries; immutable after construction."""

    def __init__(self, vocabulary: Vocabulary, table: WordTable, calibration: Calibration) -> None:
        self._vocabulary = vocabulary
        self._table = table
        self._calibration = calibration
        self._classes = np.stack(
            [unit(table.embed(entry.aliases).mean(axis=0)) for entry in vocabulary.classes]
        )
        self._neutral = np.concatenate([self._classes, table.embed(vocabulary.neutral)])

    def queries(self, texts: Sequence[str], *, encoder_id: str, text_space: str) -> TextEmbeddings:
        """Embeddings, competitors and temperature of these texts; raises UnknownWordError."""
        own = self._table.embed(texts)
        embeddings = np.stack([self._expand(text, e) for text, e in zip(texts, own, strict=True)])
        mask = np.stack([self._mask(text, e) for text, e in zip(texts, own, strict=True)])
        return TextEmbeddings(
            encoder_id=encoder_id,
            text_space=text_space,
            texts=tuple(texts),
            embeddings=embeddings,
            neutral=self._neutral,
            neutral_mask=mask,
            temperature=self._calibration.temperature,
        )

    def _expand(self, text: str, embedding: F32) -> F32:
        """The class's embedding for a trained word, else the word leaning to its nearest classes.

        Rare words lie far from what the network learned; the lean is as strong as the likeness.
        """
        trained = self._vocabulary.class_of(plain(text))
        if trained is not None:
            own: F32 = self._classes[trained]
            return own
        cosine = self._classes @ embedding
        weights = np.exp(self._calibration.sharpness * (cosine - cosine.max()))
        nearest = (weights / weights.sum()) @ self._classes
        return unit(embedding + np.float32(self._calibration.expansion) * unit(nearest))

    def _mask(self, text: str, embedding: F32) -> U8:
        """1 for every competing word (M,) uint8."""
        trained = self._vocabulary.class_of(plain(text))
        if trained is not None:
            competes = np.ones(len(self._neutral), np.uint8)
            competes[trained] = 0
            return competes
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
