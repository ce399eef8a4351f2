"""Which scores mean something: ``onemap bench queries``.

Generated apartments are mapped in this process, from pictures of sampled poses; then every map
is asked for each class name of ``mini``, each synonym that was never a training target (through
the embedding, even if a query would take it for an alias), each alias, and words that name
nothing there. A word is *present* if the map was shown such a thing and *absent* if the apartment
has none; what was hardly seen counts as neither. An answer's score is that of its best region;
it is right if that region's centre lies within 1 m of such a thing, seen from above.

The floor, below which a map answers "nothing", is the lowest at which at most one unrelated word
in twenty is answered. It is chosen on the apartments with odd seeds, and the rates are measured
on those with even seeds. Seeds from 800 on are used by nothing else: training begins at 1000,
the evaluation of the encoder at 900.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from onemap_mapper.config import MapperConfig
from onemap_mapper.replies import similarity_reply
from onemap_mapper.similarity import ScoreCache, TextQuery, text_query
from onemap_perception.config import PerceptionConfig
from onemap_perception.encoders.mini import SHIPPED, MiniEncoder, MiniParams
from onemap_perception.encoders.params import EncoderParams
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_perception.text.vocabulary import Vocabulary, load_vocabulary
from onemap_shared.config import load
from onemap_shared.geometry import F32
from onemap_shared.messages import SimilarityRequest
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import HELD_OUT, TRAINING, Style
from onemap_simulator.ground_truth.truth import horizontal_distances
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.mapping import MappedScene, map_scene
from onemap_tools.bench.parser import Parser

FIRST_SEED = 800
NEAR_M = 1.0  # from a region's centre to the thing, seen from above
# Everywhere, or above what a map keeps: nobody asks where they are.
EXCLUDED_CLASSES = frozenset({"floor", "wall", "ceiling"})
# Words of the shipped table for things that no apartment has and that are no other name, part or
# kind of a class. The vocabulary's neutral words join them.
UNRELATED = (
    "aquarium", "baseball bat", "bird cage", "broom", "calculator", "cat tree", "chess set",
    "christmas tree", "crutch", "dumbbell", "fire extinguisher", "fireplace", "golf club", "harp",
    "headphones", "helmet", "ironing board", "kite", "ladder", "lawn mower", "loudspeaker",
    "mailbox", "mop", "piano", "pizza", "printer", "record player", "robot", "robot vacuum",
    "roller skates", "saw", "scissors", "skateboard", "skis", "staircase", "stapler", "stroller",
    "surfboard", "telephone", "tennis racket", "tent", "treadmill", "tripod", "trumpet",
    "umbrella stand", "vacuum cleaner", "wheelchair", "wrench",
)  # fmt: skip
FLOORS = tuple(round(0.01 * step, 2) for step in range(1, 100))
SHOWN_FLOORS = (0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5)
MAX_APARTMENTS = 100  # seeds up to the evaluation's
MAX_FALSE_POSITIVE_RATE = 0.05  # the share of unrelated words that the chosen floor may let through
STYLES = {"training": (TRAINING,), "held-out": (HELD_OUT,), "both": (TRAINING, HELD_OUT)}


@dataclass(frozen=True, slots=True)
class QueryWord:
    """A text, the class it names (empty: none) and its group in the report."""

    text: str
    category: str
    group: str


@dataclass(frozen=True, slots=True)
class QueryOutcome:
    """One question to one map. present: the map was shown such a thing; near: so is the answer."""

    word: QueryWord
    seed: int
    present: bool
    score: float
    near: bool


@dataclass(frozen=True, slots=True)
class QueryBenchParams:
    """Which apartments, and how many pictures of each make its map."""

    seeds: tuple[int, ...]
    styles: tuple[Style, ...] = (TRAINING,)
    pictures: int = 40


@dataclass(frozen=True, slots=True)
class EncoderPair:
    """The encoder as it ships, and the same with every synonym sent through the embedding."""

    shipped: Encoder
    without_aliases: Encoder

    def queries(self, words: Sequence[QueryWord]) -> list[TextQuery]:
        """One for each word, without its calibrated minimum."""
        device = MapperConfig().torch_device
        made = []
        for word in words:
            encoder = self.without_aliases if word.group == "synonyms" else self.shipped
            query = text_query(encoder.embed_text([word.text]), 0, device)
            made.append(replace(query, min_score=0.0))
        return made


def run(encoders: EncoderPair, params: QueryBenchParams, vocabulary: Vocabulary) -> dict[str, Any]:
    """The floor chosen on odd seeds and the rates on even ones."""
    words = query_words(vocabulary)
    questions = list(zip(words, encoders.queries(words), strict=True))
    outcomes: list[QueryOutcome] = []
    for number, seed in enumerate(params.seeds, 1):
        for style in params.styles:
            scene = generate_apartment(seed, style)
            mapped = map_scene(scene, encoders.shipped, seed, params.pictures)
            outcomes += query_map(mapped, questions, seed)
        print(f"{number} of {len(params.seeds)} apartments", file=sys.stderr)
    return summarise(outcomes, params) | {"encoder_id": encoders.shipped.encoder_id}


def query_words(vocabulary: Vocabulary) -> tuple[QueryWord, ...]:
    """What is asked: names, synonyms, aliases and unrelated words."""
    outcomes = [entry for entry in vocabulary.classes if entry.name not in EXCLUDED_CLASSES]
    groups = {
        "names": [(entry.name, entry.name) for entry in outcomes],
        "synonyms": [(word, entry.name) for entry in outcomes for word in entry.held_out],
        "aliases": [(word, entry.name) for entry in outcomes for word in entry.query_aliases],
        "unrelated": [(word, "") for word in (*vocabulary.neutral, *UNRELATED)],
    }
    return tuple(QueryWord(text, name, group) for group in groups for text, name in groups[group])


def query_map(
    mapped: MappedScene, questions: Sequence[tuple[QueryWord, TextQuery]], seed: int
) -> Iterator[QueryOutcome]:
    """Every word of a map, where it is known whether the answer should be no."""
    config = MapperConfig()
    known = set(mapped.scene.categories)
    for word, query in questions:
        present = word.category in mapped.observed
        if not present and word.category in known:
            continue  # hardly seen
        reply = similarity_reply(
            mapped.belief,
            ScoreCache(),
            query=query,
            request=SimilarityRequest(word.text, max_regions=1),
            params=config,
        )
        near = present and _distance_m(mapped.scene, word.category, reply.centres_m[0]) <= NEAR_M
        yield QueryOutcome(word, seed, present, reply.best_score, near)


def _distance_m(scene: Scene, category: str, place: F32) -> float:
    """From a place (2,) to the nearest thing of the category, seen from above."""
    things = [i for i, thing in enumerate(scene.objects) if thing.category == category]
    faces = scene.faces[np.isin(scene.face_object, things)]
    triangles = scene.vertices[faces].astype(np.float64)
    return float(horizontal_distances(triangles, place.astype(np.float64)).min())


def summarise(outcomes: Sequence[QueryOutcome], params: QueryBenchParams) -> dict[str, Any]:
    """What ``--json`` prints, but for the encoder's name."""
    odd = [one for one in outcomes if one.seed % 2]
    even = [one for one in outcomes if not one.seed % 2]
    floor = choose_floor(odd)
    groups = tuple(dict.fromkeys(one.word.group for one in outcomes))
    return {
        "benchmark": "queries",
        "floor": floor,
        "apartments_chosen_on": len({one.seed for one in odd}) * len(params.styles),
        "apartments_measured_on": len({one.seed for one in even}) * len(params.styles),
        "pictures": params.pictures,
        "styles": [style.name for style in params.styles],
        "rates": {group: rates(_of(even, group), floor) for group in groups},
        "without_floor": {group: rates(_of(even, group), 0.0) for group in groups},
        "at": {
            f"{each:g}": {group: rates(_of(even, group), each) for group in groups}
            for each in SHOWN_FLOORS
        },
        "failing": failing(outcomes, floor),
    }


def choose_floor(outcomes: Sequence[QueryOutcome]) -> float:
    """The lowest candidate at which few enough unrelated words are answered."""
    scores = np.array([one.score for one in outcomes if one.word.group == "unrelated"])
    for floor in FLOORS:
        if np.mean(scores >= floor) <= MAX_FALSE_POSITIVE_RATE:
            return floor
    raise ValueError("no floor keeps unrelated words unanswered: scores of this encoder say little")


def rates(outcomes: Sequence[QueryOutcome], floor: float) -> dict[str, float | int | None]:
    """Shares of absent words answered, and of present words answered and answered rightly."""
    absent = [one.score >= floor for one in outcomes if not one.present]
    present = [one for one in outcomes if one.present]
    return {
        "absent": len(absent),
        "false_positive_rate": _share(absent),
        "present": len(present),
        "answered_rate": _share([one.score >= floor for one in present]),
        "right_rate": _share([one.score >= floor and one.near for one in present]),
    }


def failing(outcomes: Sequence[QueryOutcome], floor: float) -> dict[str, float]:
    """Synonyms and aliases that are answered rightly less than half as often as their class."""
    named = {
        one.word.category: _right(_texts(outcomes, "names", one.word.category), floor)
        for one in outcomes
        if one.word.group == "names"
    }
    found: dict[str, float] = {}
    for word in dict.fromkeys(one.word for one in outcomes if one.word.group != "names"):
        right = _right(_texts(outcomes, word.group, word.text), floor)
        if word.category and right < 0.5 * named.get(word.category, 0.0):
            found[word.text] = right
    return dict(sorted(found.items(), key=lambda item: item[1]))


def _of(outcomes: Sequence[QueryOutcome], group: str) -> list[QueryOutcome]:
    return [one for one in outcomes if one.word.group == group]


def _texts(outcomes: Sequence[QueryOutcome], group: str, text: str) -> list[QueryOutcome]:
    return [one for one in _of(outcomes, group) if one.word.text == text and one.present]


def _right(outcomes: Sequence[QueryOutcome], floor: float) -> float:
    return _share([one.score >= floor and one.near for one in outcomes]) or 0.0


def _share(flags: Sequence[bool]) -> float | None:
    return round(float(np.mean(flags)), 3) if flags else None


def encoder_pair(config: EncoderParams) -> EncoderPair:
    """The configured encoder; raises BackendError."""
    shipped = make_encoder(config)
    if isinstance(config, MiniParams):
        return EncoderPair(shipped, MiniEncoder(config, aliases=False))
    return EncoderPair(shipped, shipped)


def main(arguments: list[str] | None = None) -> int:
    """``onemap bench queries``; returns the exit code."""
    parser = Parser(
        prog="onemap bench queries",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--config", type=Path, help="measure this deployment's encoder")
    parser.add_argument("--apartments", type=int, default=10, help="even; half of them choose")
    parser.add_argument("--pictures", type=int, default=40, help="of each apartment")
    parser.add_argument("--style", choices=STYLES, default="both", help="of the apartments")
    parser.add_argument("--threads", type=int, default=1, help="CPU threads of torch")
    parser.add_argument("--json", action="store_true", help="one JSON object as the last line")
    options = parser.parse_args(arguments)
    if not 2 <= options.apartments <= MAX_APARTMENTS:
        raise ValueError(f"--apartments must lie between 2 and {MAX_APARTMENTS}")
    if options.pictures < 1:
        raise ValueError(f"--pictures is {options.pictures}; a map needs at least one")
    torch.set_num_threads(options.threads)
    config = load(options.config, "perception", PerceptionConfig)[2].encoder
    params = QueryBenchParams(
        tuple(range(FIRST_SEED, FIRST_SEED + options.apartments)),
        STYLES[options.style],
        options.pictures,
    )
    try:
        result = run(encoder_pair(config), params, load_vocabulary(SHIPPED))
    except BackendError as problem:
        raise ValueError(str(problem)) from problem
    print(json.dumps(result) if options.json else "\n".join(table_lines(result)))
    return 0


def table_lines(result: dict[str, Any]) -> list[str]:
    """The report for people."""
    head = (
        f"encoder {result['encoder_id']}: floor {result['floor']:g}, measured on "
        f"{result['apartments_measured_on']} apartments of {result['pictures']} pictures"
    )
    rows = [
        head,
        f"{'words':12}{'absent':>8}{'answered':>10}{'present':>9}{'answered':>10}{'right':>8}",
    ]
    for group, each in result["rates"].items():
        shares = [each[key] for key in ("false_positive_rate", "answered_rate", "right_rate")]
        wrong, answered, right = ("-" if s is None else f"{s:.3f}" for s in shares)
        rows.append(
            f"{group:12}{each['absent']:>8}{wrong:>10}{each['present']:>9}{answered:>10}{right:>8}"
        )
    return rows
