"""Words to vectors: a shipped table of common nouns, and MiniLM where it is installed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from onemap_perception.encoders.protocol import UnknownWordError
from onemap_perception.text.minilm import INSTALL
from onemap_shared.geometry import F32
from onemap_shared.names import normalised

TABLE_FILE = "words.npz"
CACHED = 4096  # texts kept from the sentence encoder: 6 MB at 384 numbers

Embed = Callable[[Sequence[str]], F32]


class EmbeddingTable:
    """Embeddings of known words; others go to the sentence encoder, if there is one.

    ``sentence_encoder`` takes prompts, ``prompt`` holds ``{}`` for the word.
    """

    def __init__(
        self,
        words: Sequence[str],
        embeddings: F32,
        *,
        prompt: str,
        sentence_encoder: Embed | None = None,
    ) -> None:
        self._rows = dict(zip(words, embeddings, strict=True))
        self._prompt = prompt
        self._sentence_encoder = sentence_encoder
        self._asked: dict[str, F32] = {}

    @property
    def words(self) -> tuple[str, ...]:
        """The words of the table itself."""
        return tuple(self._rows)

    def embed(self, texts: Sequence[str]) -> F32:
        """Unit rows (N, D) float32; raises UnknownWordError that names all unknown words."""
        unknown = [text for text in texts if not self.can_embed(text)]
        if unknown:
            raise self.unknown_word_error(dict.fromkeys(unknown, ()))
        return np.stack([self._row(normalised(text)) for text in texts])

    def can_embed(self, text: str) -> bool:
        """Whether ``embed`` takes this text."""
        return self._sentence_encoder is not None or self._known(normalised(text)) is not None

    def contains(self, text: str) -> bool:
        """Whether the table itself has this word, in whatever number."""
        return any(spelling in self._rows for spelling in lookup_forms(normalised(text)))

    def _known(self, word: str) -> F32 | None:
        for spelling in lookup_forms(word):
            known: F32 | None = self._rows.get(spelling, self._asked.get(spelling))
            if known is not None:
                return known
        return None

    def _row(self, word: str) -> F32:
        known = self._known(word)
        if known is not None:
            return known
        assert self._sentence_encoder is not None
        row: F32 = self._sentence_encoder([self._prompt.format(word)])[0]
        if len(self._asked) < CACHED:
            self._asked[word] = row
        return row

    def unknown_word_error(self, unknown: Mapping[str, tuple[str, ...]]) -> UnknownWordError:
        """The error about texts that this table has no embedding for, with near known words."""
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
    """A word as the table may have it: as it is, or without an ending of the plural."""
    return (word, word.removesuffix("s"), word.removesuffix("es"))


def join_words(parts: Sequence[str], last: str) -> str:
    """The parts, one or more, as a sentence lists them: a, b and c."""
    return f" {last} ".join(part for part in (", ".join(parts[:-1]), parts[-1]) if part)


def load_table(folder: Path, *, prompt: str, sentence_encoder: Embed | None) -> EmbeddingTable:
    """Read ``words.npz``: words (N,) str, embeddings (N, D) float16. Raises ValueError."""
    path = folder / TABLE_FILE
    try:
        with np.load(path, allow_pickle=False) as file:
            words, rows = file["words"], file["embeddings"].astype(np.float32)
    except (OSError, ValueError, KeyError) as problem:
        raise ValueError(f"cannot read the word table {path}: {problem}") from problem
    if rows.ndim != 2 or len(words) != len(rows) or not np.isfinite(rows).all():
        raise ValueError(f"the word table {path} is damaged: rows {rows.shape}, {len(words)} words")
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    return EmbeddingTable(words.tolist(), rows, prompt=prompt, sentence_encoder=sentence_encoder)
