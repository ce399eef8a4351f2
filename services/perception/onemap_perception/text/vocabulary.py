"""The words of ``mini``: classes, embeddings that ship with it, and its calibration."""
# Touches files: vocabulary, words, calibration.

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from onemap_perception.errors import UnknownWordError
from onemap_perception.text.embeddings import EmbedTexts, unit_rows
from onemap_perception.text.minilm import INSTALL
from onemap_shared.geometry import F32
from onemap_shared.names import normalised

VOCABULARY_FILE = "vocabulary.json"


@dataclass(frozen=True, slots=True)
class ObjectClass:
    """One trained class. ``aliases`` (the name among them): training targets; ``held_out``:
    synonyms for evaluation only; ``query_aliases``: names whose embedding is known to fail, a
    query with one is answered as the class."""

    name: str
    aliases: tuple[str, ...]
    held_out: tuple[str, ...]
    query_aliases: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """Classes, unrelated nouns (``neutral``) and further nouns with a shipped embedding.

    ``prompt`` holds ``{}``; training and query use the same one.
    """

    prompt: str
    classes: tuple[ObjectClass, ...]
    neutral: tuple[str, ...]
    common: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Class names in the order of the training labels."""
        return tuple(entry.name for entry in self.classes)

    @property
    def words(self) -> tuple[str, ...]:
        """Every word, sorted, without repeats."""
        known = {word for entry in self.classes for word in (*entry.aliases, *entry.held_out)}
        return tuple(sorted(known | set(self.neutral) | set(self.common)))

    def class_of(self, word: str) -> int | None:
        """Index of the class that ``word`` was trained as, None if it was not trained."""
        for index, entry in enumerate(self.classes):
            if word in entry.aliases:
                return index
        return None

    def query_alias_of(self, word: str) -> int | None:
        """Index of the class that ``word`` stands for in queries only, None if for none."""
        for index, entry in enumerate(self.classes):
            if word in entry.query_aliases:
                return index
        return None


def load_vocabulary(folder: Path) -> Vocabulary:
    """Read ``vocabulary.json``; raises ValueError naming what is wrong."""
    path = folder / VOCABULARY_FILE
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        classes = tuple(
            ObjectClass(
                entry["name"],
                tuple(entry["aliases"]),
                tuple(entry["held_out"]),
                tuple(entry.get("also", ())),
            )
            for entry in document["classes"]
        )
        return Vocabulary(
            document["prompt"], classes, tuple(document["neutral"]), tuple(document["common"])
        )
    except OSError as problem:
        raise ValueError(f"cannot read {path}: {problem.strerror}") from problem
    except (ValueError, KeyError, TypeError) as problem:
        raise ValueError(f"{path} is not a vocabulary: {problem}") from problem


CALIBRATION_FILE = "calibration.json"


@dataclass(frozen=True, slots=True)
class Calibration:
    """Fitted on held-out apartments by ``onemap train mini``; fields as in ``calibration.json``.

    temperature: factor of the cosine in the softmax. expansion: weight of the nearest classes'
    embedding that is added to a query's own. sharpness: factor of the cosine in the softmax that
    weights those classes. synonym: cosine to the query from which a class or neutral word does
    not compete with it. floor: best score below which a query is answered "not here", measured
    by ``onemap models calibrate``; 0: not measured. placed: highest cosine to any class below which
    a word counts as unlike all of them; 0.45 excludes nine in ten random strings of letters and,
    of the held-out synonyms, only "telly".
    """

    temperature: float
    expansion: float
    sharpness: float
    synonym: float
    floor: float = 0.0
    placed: float = 0.0


def load_calibration(folder: Path) -> Calibration:
    """Read ``calibration.json``; raises ValueError."""
    path = folder / CALIBRATION_FILE
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
        return Calibration(**{name: float(value) for name, value in values.items()})
    except (OSError, ValueError, TypeError, AttributeError) as problem:
        raise ValueError(f"cannot read the calibration {path}: {problem}") from problem


TABLE_FILE = "words.npz"


class EmbeddingTable:
    """Embeddings of known words; other words are embedded by ``fallback``, if there is one.

    words: normalised; embeddings (N, D) float32 unit rows.
    """

    def __init__(
        self, words: Sequence[str], embeddings: F32, *, fallback: EmbedTexts | None = None
    ) -> None:
        self._rows = dict(zip(words, embeddings, strict=True))
        self._fallback = fallback

    @property
    def words(self) -> tuple[str, ...]:
        """The words of the table itself."""
        return tuple(self._rows)

    def embed(self, texts: Sequence[str]) -> F32:
        """Unit rows (N, D) float32; raises UnknownWordError that names all unknown words."""
        unknown = [text for text in texts if not self.can_embed(text)]
        if unknown:
            raise self.unknown_word_error(dict.fromkeys(unknown, ()))
        words = [normalised(text) for text in texts]
        rows = {word: self._find(word) for word in words}
        missing = [word for word, row in rows.items() if row is None]
        if missing and self._fallback is not None:
            rows.update(zip(missing, self._fallback(missing), strict=True))
        return np.stack([row for word in words if (row := rows[word]) is not None])

    def can_embed(self, text: str) -> bool:
        """Whether ``embed`` takes this text."""
        return self._fallback is not None or self.contains(text)

    def contains(self, text: str) -> bool:
        """Whether the table has this word, in the singular or the plural."""
        return self._find(normalised(text)) is not None

    def _find(self, word: str) -> F32 | None:
        for form in lookup_forms(word):
            row: F32 | None = self._rows.get(form)
            if row is not None:
                return row
        return None

    def unknown_word_error(self, unknown: Mapping[str, tuple[str, ...]]) -> UnknownWordError:
        """The error about texts without an embedding, each with known words near it."""
        named, are = named_words(unknown)
        return UnknownWordError(
            f"{named} {are} not among the {len(self._rows)} words that ship "
            f"with this encoder; for any other word install the sentence encoder: {INSTALL}",
            unknown,
        )


def lookup_forms(word: str) -> tuple[str, ...]:
    """The word, and the word without an ending of the plural."""
    return (word, word.removesuffix("s"), word.removesuffix("es"))


def named_words(unknown: Mapping[str, tuple[str, ...]]) -> tuple[str, str]:
    """The texts as a list, each with the known words near it, and "is" or "are"."""
    named = [
        f"{text!r} (did you mean {join_words([repr(word) for word in near], 'or')}?)"
        if near
        else repr(text)
        for text, near in unknown.items()
    ]
    return join_words(named, "and"), "is" if len(named) == 1 else "are"


def join_words(parts: Sequence[str], last: str) -> str:
    """One or more parts as an English list: ``a, b and c`` with "and" as ``last``."""
    return f" {last} ".join(part for part in (", ".join(parts[:-1]), parts[-1]) if part)


def load_table(folder: Path, *, fallback: EmbedTexts | None = None) -> EmbeddingTable:
    """Read ``words.npz``: words (N,) str, embeddings (N, D) float16. Raises ValueError."""
    path = folder / TABLE_FILE
    try:
        with np.load(path, allow_pickle=False) as file:
            words, rows = file["words"], file["embeddings"].astype(np.float32)
    except (OSError, ValueError, KeyError) as problem:
        raise ValueError(f"cannot read the word table {path}: {problem}") from problem
    if rows.ndim != 2 or len(words) != len(rows) or not np.isfinite(rows).all():
        raise ValueError(f"the word table {path} is damaged: rows {rows.shape}, {len(words)} words")
    return EmbeddingTable(words.tolist(), unit_rows(rows), fallback=fallback)
