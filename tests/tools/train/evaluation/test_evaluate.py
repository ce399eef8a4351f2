"""The evaluation of an encoder that is always right, and of one that is always wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from onemap_perception.text.vocabulary import ObjectClass
from onemap_shared.geometry import F16, U8
from onemap_shared.messages import TextEmbeddings
from onemap_tools.train.data.frame_dataset import FrameDataset
from onemap_tools.train.evaluation.evaluate import evaluate
from tests.tools.train.tiny import VOCABULARY, PerfectEncoder


class InvertedEncoder(PerfectEncoder):
    """Takes walls for sofas and sofas for walls."""

    def encode(self, rgb: U8) -> F16:
        return super().encode(255 - rgb)


class WordyEncoder(PerfectEncoder):
    """Answers any other word with a direction that no patch has."""

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        known = [text in {"wall", "sofa", "panel", "divan"} for text in texts]
        queries = super().embed_text(
            [t if k else "wall" for t, k in zip(texts, known, strict=True)]
        )
        rows = queries.embeddings.copy()
        rows[~np.array(known)] = np.eye(3, dtype=np.float32)[2]
        return replace(queries, texts=tuple(texts), embeddings=rows)


def sofa_frames() -> FrameDataset:
    """Two frames: one with a sofa in the middle, one of a wall alone."""
    label = np.zeros((2, 48, 64), np.uint8)
    label[0, 16:32, 16:48] = 1
    rgb = np.repeat(np.where(label == 1, 200, 20).astype(np.uint8)[..., None], 3, axis=-1)
    return FrameDataset(rgb, label, VOCABULARY.names)


def figures(encoder: PerfectEncoder) -> Any:
    """Of the two frames."""
    return evaluate(encoder, VOCABULARY, sofa_frames(), lambda _: None)


def test_a_perfect_encoder_has_perfect_figures() -> None:
    part = figures(PerfectEncoder())
    names, held_out = part["names"], part["held_out_aliases"]
    assert names["r_precision"] == held_out["r_precision"] == 1
    assert names["auroc_pooled"] == held_out["auroc_mean_over_words"] == 1
    assert part["detector"] == {"precision": 1, "recall": 1, "wrong_per_picture": 0}
    assert part["pixel_accuracy"] == pytest.approx(1, abs=0.03)  # edges run through patches
    assert part["miou"] > 0.9
    assert (part["frames"], part["classes"]) == (2, 2)


def test_an_inverted_encoder_is_measured_as_wrong() -> None:
    part = figures(InvertedEncoder())
    names = part["names"]
    assert names["r_precision_by_word"]["sofa"] == 0
    assert names["auroc_pooled"] < 0.5
    assert part["detector"]["precision"] == 0
    assert part["pixel_accuracy"] < 0.1
    assert part["calibration_error"] > figures(PerfectEncoder())["calibration_error"]


def test_classes_are_ordered_by_figure_though_some_do_not_occur() -> None:
    words = [entry.name for entry in VOCABULARY.classes]
    extra = tuple(ObjectClass(name, (name,), ()) for name in ("absent", "floor", "gone", "lamp"))
    vocabulary = replace(VOCABULARY, classes=(*VOCABULARY.classes, *extra))
    frames = sofa_frames()
    label = frames.label.copy()
    label[0, :8], label[1, :8] = 3, 5  # floors and lamps that are taken for walls
    part: Any = evaluate(WordyEncoder(), vocabulary, replace(frames, label=label), lambda _: None)
    values = list(part["iou_by_class"].values())
    assert values == sorted(values)
    assert set(part["iou_by_class"]) == {*words, "floor", "lamp"}


def test_every_frame_is_reported() -> None:
    done: list[int] = []
    evaluate(PerfectEncoder(), VOCABULARY, sofa_frames(), done.append)
    assert done == [1, 2]
