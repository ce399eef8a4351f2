"""The encoder that ships: any image, its words, and files that are missing or damaged."""

from __future__ import annotations

import shutil
import string
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest

from onemap_perception.config import SHIPPED, MiniParams
from onemap_perception.encoders.mini import NETWORK_FILE, MiniEncoder
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import BackendError, UnknownWordError
from onemap_perception.text.minilm import find_model_folder
from onemap_perception.text.vocabulary import load_calibration, load_vocabulary
from onemap_shared.geometry import U8


@pytest.fixture(scope="module")
def encoder() -> Encoder:
    return MiniEncoder(MiniParams())


def noise(height: int, width: int) -> U8:
    return np.random.default_rng(0).integers(0, 256, (height, width, 3), dtype=np.uint8)


@pytest.mark.parametrize(
    ("height", "width", "rows", "columns"),
    [(240, 320, 30, 40), (480, 640, 30, 40), (64, 48, 8, 6), (61, 50, 8, 6), (1, 1, 1, 1)],
)
def test_every_size_gives_unit_features(
    encoder: Encoder, height: int, width: int, rows: int, columns: int
) -> None:
    features = encoder.encode(noise(height, width))
    assert features.shape == (rows, columns, 384)
    assert features.dtype == np.float16
    norms = np.linalg.norm(features.astype(np.float32), axis=-1)
    np.testing.assert_allclose(norms, 1, atol=2e-3)


def test_wrong_images_are_refused(encoder: Encoder) -> None:
    with pytest.raises(ValueError, match="rgb has dtype float32"):
        encoder.encode(np.zeros((8, 8, 3), np.float32))
    with pytest.raises(ValueError, match="rgb has shape"):
        encoder.encode(np.zeros((8, 8, 4), np.uint8))
    with pytest.raises(ValueError, match="rgb has shape"):
        encoder.encode(np.zeros((8, 8), np.uint8))


def test_without_the_sentence_encoder_an_unknown_word_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("onemap_perception.encoders.mini.find_model_folder", lambda: None)
    bare = MiniEncoder(MiniParams())
    assert bare.embed_text(["refrigerator"]).texts == ("refrigerator",)
    with pytest.raises(UnknownWordError, match=r"'refrigeratr' .did you mean 'refrigerator'"):
        bare.embed_text(["refrigeratr"])


def test_the_limit_of_a_place_lets_synonyms_pass(encoder: Encoder) -> None:
    synonyms = [word for entry in load_vocabulary(SHIPPED).classes for word in entry.held_out]
    assert encoder.embed_text(synonyms).texts == tuple(synonyms)


def refused(encoder: Encoder, words: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Which of the words the encoder refuses, with the known words that it suggests."""
    try:
        encoder.embed_text(words)
    except UnknownWordError as problem:
        return problem.words
    return {}


@pytest.mark.skipif(find_model_folder() is None, reason="needs the sentence encoder")
def test_words_are_suggested_for_misspelt_ones_and_not_for_nonsense(encoder: Encoder) -> None:
    rng = np.random.default_rng(0)
    syllables = [a + b for a in "bcdfghjklmnprstvwxz" for b in "aeiou"]
    nonsense = ["".join(rng.choice(list(string.ascii_lowercase), 6)) for _ in range(60)]
    nonsense += ["".join(rng.choice(syllables, 3)) for _ in range(60)]
    found = refused(encoder, [*nonsense, "xyzzy", "blorptang"])
    assert len(found) >= 0.85 * len(nonsense)
    assert sum(map(bool, found.values())) <= 0.05 * len(nonsense)
    assert found["xyzzy"] == found["blorptang"] == ()
    names = [name for name in load_vocabulary(SHIPPED).names if len(name) > 4]
    slips = {name[:2] + name[3] + name[2] + name[4:]: name for name in names}  # two letters swapped
    found = refused(encoder, list(slips))
    assert sum(slips[slip] in near for slip, near in found.items()) >= 0.95 * len(found)


def copied(folder: Path) -> Path:
    shutil.copytree(SHIPPED, folder / "mini")
    return folder / "mini"


@pytest.mark.skipif(find_model_folder() is None, reason="needs the sentence encoder")
@pytest.mark.parametrize(
    ("slip", "word"),
    [
        ("refridgerator", "refrigerator"),
        ("dinning table", "dining table"),
    ],
)
def test_a_slip_of_the_pen_is_asked_back_whatever_it_means(
    encoder: Encoder, slip: str, word: str
) -> None:
    assert refused(encoder, [slip])[slip][0] == word


def test_damaged_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(BackendError, match=r"mini\.onnx are missing: correct perception\."):
        MiniEncoder(MiniParams(folder=tmp_path))
    folder = copied(tmp_path)
    weights = folder / NETWORK_FILE
    weights.write_bytes(weights.read_bytes()[:1000])
    with pytest.raises(BackendError, match=r"mini\.onnx are damaged"):
        MiniEncoder(MiniParams(folder=folder))
    (folder / NETWORK_FILE).write_bytes((SHIPPED / NETWORK_FILE).read_bytes())
    for name in ("calibration.json", "words.npz", "vocabulary.json"):
        (folder / name).unlink()
        with pytest.raises(BackendError, match=name.replace(".", r"\.")):
            MiniEncoder(MiniParams(folder=folder))


def test_the_card_is_of_these_weights(encoder: Encoder) -> None:
    card = (SHIPPED / "MODEL_CARD.md").read_text(encoding="utf-8")
    assert f"on encoder `{encoder.encoder_id}`" in card
    assert f"softmax of {load_calibration(SHIPPED).temperature:g} x cosine" in card
    assert f"from a best score of {load_calibration(SHIPPED).floor:g} on" in card


def test_an_image_is_asked_as_a_word_that_names_no_class(encoder: Encoder) -> None:
    assert isinstance(encoder, MiniEncoder)
    query = encoder.embed_image(noise(60, 90))
    words = encoder.embed_text(["sofa"])
    assert (query.encoder_id, query.text_space) == (words.encoder_id, words.text_space)
    assert (query.embeddings.shape, query.floor) == ((1, 384), 0.0)
    assert np.linalg.norm(query.embeddings) == pytest.approx(1, abs=1e-4)
    np.testing.assert_array_equal(query.neutral, words.neutral)
    assert query.temperature == words.temperature


@pytest.mark.parametrize("scale", [2, 5])
def test_an_image_means_the_same_at_any_size(encoder: Encoder, scale: int) -> None:
    assert isinstance(encoder, MiniEncoder)
    sizes = ((80, 60), (80 * scale, 60 * scale))
    images = (cv2.resize(noise(6, 8), size, interpolation=cv2.INTER_CUBIC) for size in sizes)
    one, other = (encoder.embed_image(image.astype(np.uint8)).embeddings[0] for image in images)
    assert one @ other > 0.97
