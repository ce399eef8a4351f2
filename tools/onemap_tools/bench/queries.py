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
import torch

from onemap_mapper.query.replies import similarity_reply
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery, text_query
from onemap_perception.encoders.mini import SHIPPED, MiniEncoder, MiniParams
from onemap_perception.encoders.params import EncoderParams
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder, with_channels
from onemap_perception.text.vocabulary import Vocabulary, load_vocabulary
from onemap_shared.geometry import F32
from onemap_shared.messages import SimilarityRequest
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import HELD_OUT, TRAINING
from onemap_simulator.ground_truth.truth import horizontal_distances
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.mapping import MappedScene, map_scene
from onemap_tools.bench.query_report import (
    QueryBenchParams,
    QueryOutcome,
    QueryWord,
    summarise,
)

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
STYLES = {"training": (TRAINING,), "held-out": (HELD_OUT,), "both": (TRAINING, HELD_OUT)}


@dataclass(frozen=True, slots=True)
class EncoderPair:
    """The configured encoder, and the same without aliases: every synonym is embedded."""

    configured: Encoder
    without_aliases: Encoder

    def queries(self, words: Sequence[QueryWord]) -> list[TextQuery]:
        """One query per word, without its calibrated minimum score."""
        device = torch.device("cpu")
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
    categories = set(mapped.scene.categories)
    for word, query in questions:
        present = word.category in mapped.observed
        if not present and word.category in categories:
            continue  # in the apartment, but not shown well enough
        reply = similarity_reply(
            MapScores(mapped.belief).of([query]),
            request=SimilarityRequest(word.text, max_regions=1),
        )
        near = present and distance_m(mapped.scene, word.category, reply.centres_m[0]) <= NEAR_M
        yield QueryOutcome(word, seed, present, reply.best_score, near)


def distance_m(scene: Scene, category: str, place: F32) -> float:
    """Horizontal distance from a place (2,) to the nearest object of the category."""
    things = [i for i, thing in enumerate(scene.objects) if thing.category == category]
    faces = scene.faces[np.isin(scene.face_object, things)]
    triangles = scene.vertices[faces].astype(np.float64)
    return float(horizontal_distances(triangles, place.astype(np.float64)).min())


def encoder_pair(config: EncoderParams) -> EncoderPair:
    """The configured encoder, with and without aliases; raises BackendError."""
    encoder = make_encoder(config)
    if isinstance(config, MiniParams):
        plain = MiniEncoder(config, aliases=False)
        return EncoderPair(encoder, with_channels(plain, config.channels))
    return EncoderPair(encoder, encoder)
