"""Embeddings of known words, read from ``words.npz``."""
# Touches files: words.

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from onemap_perception.errors import UnknownWordError
from onemap_perception.text.minilm import INSTALL
from onemap_perception.text.text_encoder import EmbedTexts, unit_rows
from onemap_shared.geometry import F32
from onemap_shared.names import normalised

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
        named = [
            f"{text!r} (did you mean {join_words([repr(word) for word in near], 'or')}?)"
            if near
            else repr(text)
            for text, near in unknown.items()
        ]
        are = "is" if len(named) == 1 else "are"
        return UnknownWordError(
            f"{join_words(named, 'and')} {are} not among the {len(self._rows)} words that ship "
            f"with this encoder; for any other word install the sentence encoder: {INSTALL}",
            unknown,
        )


def lookup_forms(word: str) -> tuple[str, ...]:
    """The word, and the word without an ending of the plural."""
    return (word, word.removesuffix("s"), word.removesuffix("es"))


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
