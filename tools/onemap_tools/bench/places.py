"""Labelled places, from a YAML file or a scene with named objects, and what a map says of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import yaml

from onemap_perception.text.vocabulary import Vocabulary
from onemap_shared.geometry import F32, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import SimilarityReply
from onemap_simulator.scene.scene import STRUCTURE, UNNAMED, Scene

# The map's reply for each word, with the score of every cell; None: the encoder cannot place it.
Replies: TypeAlias = Mapping[str, SimilarityReply | None]
COLUMNS = ("name", "x", "y", "radius", "here", "elsewhere", "rank", "found", "looks most like")
KEYS = ("name", "x", "y", "radius_m")
MAX_M = 100_000  # of a coordinate or a radius: what is larger is not in metres
MARGIN_M = 0.3  # around an object of a scene: an answer's centre may lie on its edge


@dataclass(frozen=True, slots=True)
class PlaceLabel:
    """Something called ``name`` stands within ``radius_m`` of (x, y), metres in the map frame."""

    name: str
    x: float
    y: float
    radius_m: float


def read_labels(path: Path) -> tuple[PlaceLabel, ...]:
    """The labels of a YAML file: a list, maybe empty, of entries with KEYS.

    ValueError names the wrong entry.
    """
    try:
        entries = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as problem:
        raise ValueError(f"cannot read {path}: {problem.strerror or problem}") from problem
    except (yaml.YAMLError, UnicodeDecodeError) as problem:
        raise ValueError(f"{path} is not valid YAML: {' '.join(str(problem).split())}") from problem
    if not isinstance(entries, list):
        raise ValueError(
            f"{path} must be a list of places, each with {', '.join(KEYS)}, or [] for none"
        )
    return tuple(
        _label(entry, f"{path}, entry {number}") for number, entry in enumerate(entries, 1)
    )


def _label(entry: Any, where: str) -> PlaceLabel:
    if not isinstance(entry, dict):
        raise ValueError(f"{where} is {entry!r}; it must have {', '.join(KEYS)}")
    if missing := [key for key in KEYS if key not in entry]:
        raise ValueError(f"{where} lacks {', '.join(missing)}")
    if unknown := sorted(str(key) for key in entry if key not in KEYS):
        raise ValueError(f"{where} has the unknown key {unknown[0]!r}; known are {', '.join(KEYS)}")
    name = entry["name"]
    if not isinstance(name, str) or not name.strip():
        raise ValueError(f"{where}: name is {name!r}; it must be a word")
    for key in KEYS[1:]:
        value = entry[key]
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not (number and abs(value) <= MAX_M):
            raise ValueError(
                f"{where}: {key} is {value!r}; it must be a number of metres up to {MAX_M}"
            )
    if entry["radius_m"] <= 0:
        raise ValueError(f"{where}: radius_m is {entry['radius_m']}; it must be positive")
    return PlaceLabel(name.strip(), *(float(entry[key]) for key in KEYS[1:]))


def labels_of_scene(scene: Scene) -> tuple[PlaceLabel, ...]:
    """A label for each object with a name that is no part of the building.

    Around the middle of the rectangle that the object covers seen from above, MARGIN_M wider
    than the circle around it.
    """
    labels = []
    for index, thing in enumerate(scene.objects):
        faces = scene.faces[scene.face_object == index]
        if thing.category in STRUCTURE | {UNNAMED} or not len(faces):
            continue
        corners = scene.vertices[faces].reshape(-1, 3)[:, :2].astype(np.float64)
        lower, upper = corners.min(axis=0), corners.max(axis=0)
        x, y = (lower + upper) / 2
        radius_m = float(np.linalg.norm(upper - lower)) / 2 + MARGIN_M
        labels.append(PlaceLabel(thing.category, float(x), float(y), radius_m))
    return tuple(labels)


@dataclass(frozen=True, slots=True)
class PlaceResult:
    """What the map says about one labelled place.

    best_here, best_elsewhere: highest score of a cell in the place, and outside of all places of
    this name; None without such a cell. rank: of the first answer whose centre lies in the place;
    None if none does. looks_like: the other word with the highest score in the place. known:
    whether the encoder can place the word; without that it is not asked for.
    """

    name: str
    x: float
    y: float
    radius_m: float
    known: bool
    mapped: bool
    best_here: float | None
    best_elsewhere: float | None
    rank: int | None
    looks_like: str | None
    looks_like_score: float | None

    @property
    def found(self) -> bool:
        """Whether an answer's centre lies in the place."""
        return self.rank is not None


def place_results(
    labels: Sequence[PlaceLabel], replies: Replies, vocabulary: Vocabulary
) -> list[PlaceResult]:
    """A result per label. ``replies`` holds those of all labels' names, and of other words.

    At least one reply is not None if there are labels.
    """
    if not labels:
        return []
    answered = {word: reply for word, reply in replies.items() if reply is not None}
    grid = next(iter(answered.values())).grid
    results = []
    for label in labels:
        reply = answered.get(label.name)
        here = cells_in(label, grid)
        anywhere = np.logical_or.reduce([cells_in(p, grid) for p in labels if p.name == label.name])
        others = [
            (score, word)
            for word, other in answered.items()
            if not same_thing(word, label.name, vocabulary)
            and (score := best_score(other.scores_grid, here)) is not None
        ]
        most = max(others, default=None)
        first = next(iter(answered.values())).scores_grid
        results.append(
            PlaceResult(
                **asdict(label),
                known=reply is not None,
                mapped=best_score(first, here) is not None,
                best_here=best_score(reply.scores_grid, here) if reply else None,
                best_elsewhere=best_score(reply.scores_grid, ~anywhere) if reply else None,
                rank=rank_in(label, reply.centres_m) if reply else None,
                looks_like=most[1] if most else None,
                looks_like_score=most[0] if most else None,
            )
        )
    return results


def cells_in(label: PlaceLabel, grid: GridSpec) -> Bool:
    """Cells (nx, ny) whose centre lies in the place."""
    cells = np.argwhere(np.ones(grid.shape, bool))
    apart = np.linalg.norm(grid.centres(cells) - (label.x, label.y), axis=1)
    return np.asarray(apart <= label.radius_m).reshape(grid.shape)


def best_score(scores: F32, cells: Bool) -> float | None:
    """Highest score (nx, ny) of the observed ones of the cells; None if none was observed."""
    chosen = scores[cells & np.isfinite(scores)]
    return round(float(chosen.max()), 4) if chosen.size else None


def rank_in(label: PlaceLabel, centres_m: F32) -> int | None:
    """Rank from 1 of the first region (n, 2) whose centre lies in the place."""
    apart = np.linalg.norm(centres_m - np.array([label.x, label.y]), axis=1)
    inside = np.flatnonzero(apart <= label.radius_m)
    return int(inside[0]) + 1 if len(inside) else None


def same_thing(a: str, b: str, vocabulary: Vocabulary) -> bool:
    """Whether two words are equal or names of one class."""
    classes = [
        found
        if (found := vocabulary.class_of(word)) is not None
        else vocabulary.query_alias_of(word)
        for word in (a, b)
    ]
    return a == b or (classes[0] is not None and classes[0] == classes[1])


def within(x: float, y: float, bounds_m: Sequence[float]) -> bool:
    """Whether (x, y), metres, lies in the bounds (x_min, y_min, x_max, y_max)."""
    x_min, y_min, x_max, y_max = bounds_m
    return x_min <= x <= x_max and y_min <= y <= y_max


def outside_lines(document: Mapping[str, Any]) -> list[str]:
    """One sentence with the places that lie outside the map and its bounds; none without such."""
    outside = [
        f"{place['name']} at ({place['x']:g}, {place['y']:g})"
        for place in document["places"]
        if not place["mapped"] and not within(place["x"], place["y"], document["bounds_m"])
    ]
    if not outside:
        return []
    x_min, y_min, x_max, y_max = document["bounds_m"]
    return [
        "Not mapped because outside the map, which reaches "
        f"from ({x_min:.1f}, {y_min:.1f}) to ({x_max:.1f}, {y_max:.1f}) m: {', '.join(outside)}."
    ]


def totals(
    labels: Sequence[PlaceLabel], results: Sequence[PlaceResult], replies: Replies
) -> dict[str, Any]:
    """Counts of places, and of names by their first answer."""
    first = {
        name: rank_of_first(name, labels, replies[name])
        for name in dict.fromkeys(label.name for label in labels)
    }
    return {
        "labelled": len(labels),
        "found": sum(result.found for result in results),
        "not_mapped": sum(not result.mapped for result in results),
        "names": len(first),
        "first_answer_right": sum(right is True for right in first.values()),
        "first_answer_wrong": sum(right is False for right in first.values()),
        "without_answer": sum(right is None for right in first.values()),
        "unknown_words": sorted({result.name for result in results if not result.known}),
    }


def rank_of_first(
    name: str, labels: Sequence[PlaceLabel], reply: SimilarityReply | None
) -> bool | None:
    """Whether the first answer lies in a place of this name; None without an answer."""
    if reply is None or not len(reply.centres_m):
        return None
    places = [label for label in labels if label.name == name]
    return any(rank_in(place, reply.centres_m[:1]) is not None for place in places)


def place_document(result: PlaceResult) -> dict[str, Any]:
    """As a JSON object."""
    return {**asdict(result), "found": result.found}


def table_lines(document: Mapping[str, Any]) -> list[str]:
    """The document of a run as lines of text."""
    run = (
        f"{document['encoder_id']}, {document['frames']} frames, {document['cells']} cells, "
        f"{document['seconds']:.1f} s"
    )
    if not document["places"]:
        return ["No place is labelled: the map was asked for nothing.", run]
    rows = [COLUMNS, *(_row(place) for place in document["places"])]
    widths = [max(len(row[i]) for row in rows) for i in range(len(COLUMNS))]
    table = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    unknown = document["unknown_words"]
    return [
        *table,
        "",
        f"{document['found']} of {document['labelled']} places found; of {document['names']} names "
        f"the first answer is right for {document['first_answer_right']}, wrong for "
        f"{document['first_answer_wrong']}, and {document['without_answer']} have none.",
        *([f"Not asked for, unknown to the encoder: {', '.join(unknown)}."] if unknown else []),
        *outside_lines(document),
        run,
    ]


def _row(place: Mapping[str, Any]) -> tuple[str, ...]:
    verdict = "yes" if place["found"] else "no"
    if not place["known"]:
        verdict = "unknown word"
    elif not place["mapped"]:
        verdict = "not mapped"
    like = place["looks_like"]
    return (
        place["name"],
        *(f"{place[key]:.2f}" for key in ("x", "y", "radius_m")),
        *(_score(place[key]) for key in ("best_here", "best_elsewhere")),
        str(place["rank"] or "-"),
        verdict,
        f"{like} {_score(place['looks_like_score'])}" if like else "-",
    )


def _score(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"
