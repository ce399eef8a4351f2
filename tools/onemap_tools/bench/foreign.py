"""Figures of an encoder on the foreign test set, beside those on generated apartments.

Nothing may be chosen by these figures: the set tells how an encoder does in a stranger's rooms
only as long as no training and no setting follows it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from onemap_perception.encoders.mini import SHIPPED, MiniEncoder, MiniParams
from onemap_perception.encoders.params import EncoderParams
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_perception.text.vocabulary import Vocabulary, load_vocabulary
from onemap_simulator.scene.scene import STRUCTURE
from onemap_tools.foreign.frames import ForeignSetSpec, foreign_frames
from onemap_tools.foreign.shapes.catalogue import CATALOGUE
from onemap_tools.train.data.frame_dataset import FrameDataset, open_frames, render_frames
from onemap_tools.train.evaluation.best_answers import best_answers
from onemap_tools.train.evaluation.evaluate import evaluate
from onemap_tools.train.pipeline import frame_sets

OTHER_SETS = ("held_out", "other_style")  # of the model card
CONFUSIONS = 15  # pairs reported
MIN_PIXELS = 2000  # of a class in all pictures; a pair of a rarer one says nothing

Progress = Callable[[str, int, int], None]  # what, done, of how many


@dataclass(frozen=True, slots=True)
class ForeignBenchParams:
    """beside: folder of the generated sets' pictures, rendered if missing; None: without them."""

    spec: ForeignSetSpec = field(default_factory=ForeignSetSpec)
    beside: Path | None = None
    processes: int = 1


def strangers(vocabulary: Vocabulary) -> tuple[str, ...]:
    """Classes of the foreign set that the vocabulary has no word for."""
    return tuple(name for name in CATALOGUE if name not in vocabulary.names)


def run(
    encoder_params: EncoderParams, params: ForeignBenchParams, report: Progress
) -> dict[str, Any]:
    """All figures; ValueError in one sentence if the encoder cannot be used."""
    vocabulary = load_vocabulary(SHIPPED)
    try:
        encoder = _open_encoder(encoder_params)
        outside = strangers(vocabulary)
        frames = _foreign_dataset(vocabulary, outside, params, report)
        sets = {
            "foreign": _measure(
                "foreign", encoder, vocabulary, frames, report=report, outside=outside
            )
        }
        if params.beside is not None:
            for name in OTHER_SETS:
                other = _generated(name, vocabulary, params, report)
                sets[name] = _measure(name, encoder, vocabulary, other, report=report)
    except BackendError as problem:
        raise ValueError(str(problem)) from problem
    things = [name for name in CATALOGUE if name not in outside]
    known = [*things, *sorted(STRUCTURE)]
    for part in sets.values():
        part["miou_foreign_classes"] = mean_iou(part["iou_by_class"], known)
        part["miou_foreign_things"] = mean_iou(part["iou_by_class"], things)
    return {
        "benchmark": "foreign",
        "encoder_id": encoder.encoder_id,
        "classes": known,
        "strangers": list(outside),
        "furnishings": params.spec.furnishings,
        "sets": sets,
    }


def mean_iou(iou_by_class: dict[str, float], classes: Sequence[str]) -> float:
    """Mean over those of the classes that occur; NaN if none does."""
    values = [iou_by_class[name] for name in classes if name in iou_by_class]
    return float(np.mean(values)) if values else float("nan")


def worst_confusions(counts: Sequence[Sequence[int]], names: Sequence[str]) -> list[dict[str, Any]]:
    """The pairs that cost a class the largest share of its pixels; counts (K, K) true by taken."""
    matrix = np.array(counts, np.float64)
    total = matrix.sum(axis=1, keepdims=True)
    share = np.where(total >= MIN_PIXELS, matrix / np.maximum(total, 1), 0.0)
    np.fill_diagonal(share, 0)
    order = np.argsort(-share, axis=None, kind="stable")[:CONFUSIONS]
    pairs = zip(*np.unravel_index(order, share.shape), strict=True)
    return [
        {"of": names[true], "taken_for": names[taken], "share": round(float(share[true, taken]), 3)}
        for true, taken in pairs
        if share[true, taken] > 0
    ]


def _open_encoder(params: EncoderParams) -> Encoder:
    """The configured encoder; mini without aliases, as its model card is measured."""
    return (
        MiniEncoder(params, aliases=False)
        if isinstance(params, MiniParams)
        else make_encoder(params)
    )


def _foreign_dataset(
    vocabulary: Vocabulary, outside: Sequence[str], params: ForeignBenchParams, report: Progress
) -> FrameDataset:
    """The foreign pictures, labelled with the vocabulary's names and then the strangers."""
    words = (*vocabulary.names, *outside)
    scenes = len(params.spec.scenes)
    rgb, label = [], []
    for done, frames in enumerate(foreign_frames(words, params.spec, params.processes), 1):
        rgb += [frame.rgb for frame in frames]
        label += [frame.label for frame in frames]
        report("rendering foreign", done, scenes)
    return FrameDataset(np.stack(rgb), np.stack(label), words, scenes)


def _generated(
    name: str, vocabulary: Vocabulary, params: ForeignBenchParams, report: Progress
) -> FrameDataset:
    """A set of the model card, rendered as for the card."""
    assert params.beside is not None
    spec = frame_sets(0, 0)[name]
    folder = params.beside / name
    for done in render_frames(folder, vocabulary.names, spec, params.processes):
        report(f"rendering {name}", done, spec.count)
    return open_frames(folder)


def _measure(
    title: str,
    encoder: Encoder,
    vocabulary: Vocabulary,
    frames: FrameDataset,
    *,
    report: Progress,
    outside: Sequence[str] = (),
) -> dict[str, Any]:
    """The card's figures of a set, the trust in best answers, and the worst confusions."""

    def measuring(done: int) -> None:
        report(f"measuring {title}", done, 2 * len(frames))

    figures = evaluate(encoder, vocabulary, frames, measuring)
    pairs = list(zip(frames.rgb, frames.label, strict=True))
    figures["best_answer"] = best_answers(
        encoder,
        vocabulary.names,
        pairs,
        lambda done: measuring(len(frames) + done),
        outside,
    )
    figures["confusions"] = worst_confusions(figures.pop("confusion"), vocabulary.names)  # type: ignore[arg-type]
    return figures
