"""Compares the results of a search with the simulator's ground truth."""

from __future__ import annotations

from collections.abc import Callable, Collection
from math import nan
from typing import Any

from onemap_perception.text.vocabulary import ObjectClass, Vocabulary
from onemap_shared.messages import Truth
from onemap_shared.names import normalised
from onemap_tools.demo.summary import ObjectSummary

Position = tuple[float, ...]
# Asks for the ground truth of a category at a position in metres; None without a reply.
TruthQuery = Callable[[str, Position], Truth | None]


def vocabulary_names(vocabulary: Vocabulary) -> frozenset[str]:
    """All names of the classes that the encoder ``mini`` was trained on."""
    return frozenset(word for entry in vocabulary.classes for word in _names(entry))


def _names(entry: ObjectClass) -> tuple[str, ...]:
    return (entry.name, *entry.aliases, *entry.held_out, *entry.query_aliases)


def scene_category(word: str, categories: Collection[str], vocabulary: Vocabulary) -> str:
    """The scene's category for an object that a user calls ``word``.

    The word itself if the scene has that category, else a category that is a synonym in the
    vocabulary ("couch" where the scene has "sofa"), else the word.
    """
    wanted = normalised(word)
    if wanted in categories:
        return wanted
    for entry in vocabulary.classes:
        names = _names(entry)
        if wanted in names:
            return next((name for name in names if name in categories), wanted)
    return wanted


def evaluate_result(result: dict[str, Any], name: str, query: TruthQuery) -> ObjectSummary:
    """Compare the gateway's result for one object with the ground truth of category ``name``.

    It is not judged without a reply, or if the scene has unnamed objects and none of that
    category.
    """

    def truth_at(place: list[float] | None) -> Truth | None:
        return query(name, tuple(place)) if place else None

    start, end = truth_at(result["start_xy_m"]), truth_at(result["end_xy_m"])
    claimed = truth_at(result["position_m"])
    return ObjectSummary(
        name=result["name"],
        outcome=result["outcome"],
        reason=result["reason"],
        position_m=tuple(result["position_m"] or ()),
        time_s=result["duration_s"],
        path_length_m=result["path_length_m"],
        shortest_path_m=start.shortest_path_m if start else nan,
        true_distance_m=end.distance_m if end else nan,
        goal_distance_m=end.shortest_path_m if end else nan,
        nearest=claimed.nearest if claimed else "",
        judged=end is not None and (end.names_complete or end.instances > 0),
    )
