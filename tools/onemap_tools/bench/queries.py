"""Scores of present and absent objects: the floor of an encoder and its error rates.

Every map of a generated apartment is queried for class names, synonyms that were never training
targets, aliases, and words that name nothing there. An object is *present* if the map was shown
it well enough and *absent* if the apartment has none; otherwise the query does not count. The
score of a reply is that of its best region.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from onemap_mapper.config import MapperConfig
from onemap_mapper.replies import similarity_reply
from onemap_mapper.similarity import ScoreCache, TextQuery, text_query
from onemap_perception.encoders.mini import SHIPPED, MiniEncoder, MiniParams
from onemap_perception.encoders.params import EncoderParams
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_perception.text.vocabulary import Vocabulary, load_vocabulary
from onemap_shared.geometry import F32
from onemap_shared.messages import SimilarityRequest
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import HELD_OUT, TRAINING, Style
from onemap_simulator.ground_truth.truth import horizontal_distances
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.mapping import MappedScene, map_scene

SEEDS = tuple(range(800, 900))  # encoders are evaluated on 900 to 999, trained from 1000 on
NEAR_M = 1.0  # horizontal distance from a region's centre to the object
# Everywhere, or above the map's height limit.
EXCLUDED_CLASSES = frozenset({"floor", "wall", "ceiling"})
# Words of the shipped table for objects that no apartment has and that are no synonym, part or
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
MAX_FALSE_POSITIVE_RATE = 0.05  # of unrelated words, at the chosen floor
STYLES = {"training": (TRAINING,), "held-out": (HELD_OUT,), "both": (TRAINING, HELD_OUT)}


@dataclass(frozen=True, slots=True)
class QueryWord:
    """A text, the class that it names (empty: none) and its group in the report."""

    text: str
    category: str
    group: str


@dataclass(frozen=True, slots=True)
class QueryOutcome:
    """The reply of one map to one word. near: the best region lies near such an object."""

    word: QueryWord
    seed: int
    present: bool
    score: float
    near: bool


@dataclass(frozen=True, slots=True)
class QueryBenchParams:
    """The apartments, and the number of images that make the map of each."""

    seeds: tuple[int, ...]
    styles: tuple[Style, ...]
    images: int


@dataclass(frozen=True, slots=True)
class EncoderPair:
    """The configured encoder, and the same without aliases: every synonym is embedded."""

    configured: Encoder
    without_aliases: Encoder

    def queries(self, words: Sequence[QueryWord]) -> list[TextQuery]:
        """One query per word, without its calibrated minimum score."""
        device = MapperConfig().torch_device
        made = []
        for word in words:
            encoder = self.without_aliases if word.group == "synonyms" else self.configured
            query = text_query(encoder.embed_text([word.text]), 0, device)
            made.append(replace(query, min_score=0.0))
        return made


def run_configured(
    config: EncoderParams, params: QueryBenchParams, report: Callable[[int], None]
) -> dict[str, Any]:
    """Measure the encoder of a configuration; ValueError if it cannot be loaded."""
    try:
        return run(encoder_pair(config), params, load_vocabulary(SHIPPED), report)
    except BackendError as problem:
        raise ValueError(str(problem)) from problem


def run(
    encoders: EncoderPair,
    params: QueryBenchParams,
    vocabulary: Vocabulary,
    report: Callable[[int], None],
) -> dict[str, Any]:
    """The floor chosen on odd seeds and the rates on even ones.

    ``report`` receives the number of apartments done.
    """
    words = query_words(vocabulary)
    questions = list(zip(words, encoders.queries(words), strict=True))
    outcomes: list[QueryOutcome] = []
    for number, seed in enumerate(params.seeds, 1):
        for style in params.styles:
            scene = generate_apartment(seed, style)
            mapped = map_scene(scene, encoders.configured, seed, params.images)
            outcomes += query_map(mapped, questions, seed)
        report(number)
    return summarise(outcomes, params) | {"encoder_id": encoders.configured.encoder_id}


def query_words(vocabulary: Vocabulary) -> tuple[QueryWord, ...]:
    """The query words: names, synonyms, aliases and unrelated words."""
    classes = [entry for entry in vocabulary.classes if entry.name not in EXCLUDED_CLASSES]
    groups = {
        "names": [(entry.name, entry.name) for entry in classes],
        "synonyms": [(word, entry.name) for entry in classes for word in entry.held_out],
        "aliases": [(word, entry.name) for entry in classes for word in entry.query_aliases],
        "unrelated": [(word, "") for word in (*vocabulary.neutral, *UNRELATED)],
    }
    return tuple(QueryWord(text, name, group) for group in groups for text, name in groups[group])


def query_map(
    mapped: MappedScene, questions: Sequence[tuple[QueryWord, TextQuery]], seed: int
) -> Iterator[QueryOutcome]:
    """Query a map for every word that is clearly present or absent."""
    config = MapperConfig()
    categories = set(mapped.scene.categories)
    for word, query in questions:
        present = word.category in mapped.observed
        if not present and word.category in categories:
            continue  # in the apartment, but not shown well enough
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
    """Horizontal distance from a place (2,) to the nearest object of the category."""
    things = [i for i, thing in enumerate(scene.objects) if thing.category == category]
    faces = scene.faces[np.isin(scene.face_object, things)]
    triangles = scene.vertices[faces].astype(np.float64)
    return float(horizontal_distances(triangles, place.astype(np.float64)).min())


def summarise(outcomes: Sequence[QueryOutcome], params: QueryBenchParams) -> dict[str, Any]:
    """The report, except for the encoder's name."""
    odd = [one for one in outcomes if one.seed % 2]
    even = [one for one in outcomes if not one.seed % 2]
    floor = choose_floor(odd)
    groups = tuple(dict.fromkeys(one.word.group for one in outcomes))
    return {
        "benchmark": "queries",
        "floor": floor,
        "apartments_chosen_on": len({one.seed for one in odd}) * len(params.styles),
        "apartments_measured_on": len({one.seed for one in even}) * len(params.styles),
        "pictures": params.images,
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
    """The lowest candidate that keeps ``MAX_FALSE_POSITIVE_RATE``; ValueError if none does."""
    scores = np.array([one.score for one in outcomes if one.word.group == "unrelated"])
    for floor in FLOORS:
        if np.mean(scores >= floor) <= MAX_FALSE_POSITIVE_RATE:
            return floor
    raise ValueError("no floor keeps unrelated words unanswered: scores of this encoder say little")


def rates(outcomes: Sequence[QueryOutcome], floor: float) -> dict[str, float | int | None]:
    """Shares of absent words answered, and of present words answered and answered correctly."""
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
    """Synonyms and aliases answered correctly less than half as often as their class's name."""
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
    """The configured encoder, with and without aliases; raises BackendError."""
    encoder = make_encoder(config)
    if isinstance(config, MiniParams):
        return EncoderPair(encoder, MiniEncoder(config, aliases=False))
    return EncoderPair(encoder, encoder)


def table_lines(result: dict[str, Any]) -> list[str]:
    """The report as a table."""
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
