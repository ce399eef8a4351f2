"""Labelled places, from a YAML file or a scene with named objects, and what a map says of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from onemap_perception.text.vocabulary import Vocabulary
from onemap_shared.geometry import F32, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import SimilarityReply
from onemap_simulator.scene.scene import STRUCTURE, UNNAMED, Scene

# The map's reply for each word, with the score of every cell; None: the encoder cannot place it.
Replies: TypeAlias = Mapping[str, SimilarityReply | None]
COLUMNS = ("name", "x", "y", "radius", "here", "elsewhere", "rank", "found", "looks most like")
MARGIN_M = 0.3  # around an object of a scene: an answer's centre may lie on its edge
# Metres up to 100 km: what is larger is in another unit.
Coordinate = Annotated[float, Field(ge=-1e5, le=1e5, allow_inf_nan=False)]


class PlaceLabel(BaseModel):
    """Something called ``name`` stands within ``radius_m`` of (x, y), metres in the map frame."""

    model_config = ConfigDict(frozen=True, extra="forbid", str_strip_whitespace=True)
    name: Annotated[str, Field(min_length=1)]
    x: Coordinate
    y: Coordinate
    radius_m: Annotated[float, Field(gt=0, le=1e5)]


def read_labels(path: Path) -> tuple[PlaceLabel, ...]:
    """The labels of a YAML file: a list, maybe empty; ValueError names the wrong entry."""
    try:
        entries = yaml.safe_load(path.read_text(encoding="utf-8"))
        return tuple(TypeAdapter(list[PlaceLabel]).validate_python(entries))
    except OSError as problem:
        raise ValueError(f"cannot read {path}: {problem.strerror or problem}") from problem
    except (yaml.YAMLError, UnicodeDecodeError) as problem:
        raise ValueError(f"{path} is not valid YAML: {' '.join(str(problem).split())}") from problem
    except ValidationError as problem:
        first = problem.errors()[0]
        number, *key = first["loc"] or ("",)
        where = f", entry {int(number) + 1}" if number != "" else ""
        raise ValueError(
            f"{path}{where}: {' '.join(map(str, (*key, first['msg'])))}; it must be a list of "
            "places with name, x, y, radius_m in metres, or [] for none"
        ) from problem


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
        x, y = ((lower + upper) / 2).tolist()
        radius_m = float(np.linalg.norm(upper - lower)) / 2 + MARGIN_M
        labels.append(PlaceLabel(name=thing.category, x=x, y=y, radius_m=radius_m))
    return tuple(labels)


def place_results(
    labels: Sequence[PlaceLabel], replies: Replies, vocabulary: Vocabulary
) -> list[dict[str, Any]]:
    """A JSON object per label. ``replies`` holds those of all labels' names, and of other words.

    best_here, best_elsewhere: highest score of a cell in the place, and outside of all places of
    this name; None without such a cell. rank: of the first answer whose centre lies in the place;
    None if none does: then it is not found. looks_like: the other word with the highest score in
    the place. known: whether the encoder can place the word; without that it is not asked for.
    """
    answered = {word: reply for word, reply in replies.items() if reply is not None}
    results = []
    for label in labels:
        first, reply = next(iter(answered.values())), answered.get(label.name)
        here = cells_in(label, first.grid)
        named = [cells_in(each, first.grid) for each in labels if each.name == label.name]
        others = [
            (score, word)
            for word, other in answered.items()
            if not same_thing(word, label.name, vocabulary)
            and (score := best_score(other.scores_grid, here)) is not None
        ]
        score, like = max(others, default=(None, None))
        rank = rank_in(label, reply.centres_m) if reply else None
        elsewhere = ~np.logical_or.reduce(named)
        results.append(
            {
                **label.model_dump(),
                "known": reply is not None,
                "mapped": best_score(first.scores_grid, here) is not None,
                "best_here": best_score(reply.scores_grid, here) if reply else None,
                "best_elsewhere": best_score(reply.scores_grid, elsewhere) if reply else None,
                "rank": rank,
                "looks_like": like,
                "looks_like_score": score,
                "found": rank is not None,
            }
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


def totals(
    labels: Sequence[PlaceLabel], results: Sequence[Mapping[str, Any]], replies: Replies
) -> dict[str, Any]:
    """Counts of places, and of names by their first answer."""
    verdicts: list[bool | None] = []
    for name in dict.fromkeys(label.name for label in labels):
        reply = replies[name]
        places = [label for label in labels if label.name == name]
        first = None if reply is None else reply.centres_m[:1]
        verdicts.append(
            None
            if first is None or not len(first)
            else any(rank_in(place, first) for place in places)
        )
    return {
        "labelled": len(labels),
        "found": sum(result["found"] for result in results),
        "not_mapped": sum(not result["mapped"] for result in results),
        "names": len(verdicts),
        "first_answer_right": verdicts.count(True),
        "first_answer_wrong": verdicts.count(False),
        "without_answer": verdicts.count(None),
        "unknown_words": sorted({result["name"] for result in results if not result["known"]}),
    }


def within(x: float, y: float, bounds_m: Sequence[float]) -> bool:
    """Whether (x, y), metres, lies in the bounds (x_min, y_min, x_max, y_max)."""
    x_min, y_min, x_max, y_max = bounds_m
    return x_min <= x <= x_max and y_min <= y <= y_max


def table_lines(document: Mapping[str, Any]) -> list[str]:
    """The document of a run as lines of text."""
    run = (
        f"{document['encoder_id']}, {document['frames']} frames, {document['cells']} cells, "
        f"{document['seconds']:.1f} s"
    )
    places = document["places"]
    if not places:
        return ["No place is labelled: the map was asked for nothing.", run]
    rows = [COLUMNS, *map(_row, places)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(COLUMNS))]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    lines += [
        "",
        f"{document['found']} of {document['labelled']} places found; of {document['names']} names "
        f"the first answer is right for {document['first_answer_right']}, wrong for "
        f"{document['first_answer_wrong']}, and {document['without_answer']} have none.",
    ]
    if unknown := document["unknown_words"]:
        lines.append(f"Not asked for, unknown to the encoder: {', '.join(unknown)}.")
    x_min, y_min, x_max, y_max = document["bounds_m"]
    if outside := [
        f"{place['name']} at ({place['x']:g}, {place['y']:g})"
        for place in places
        if not place["mapped"] and not within(place["x"], place["y"], document["bounds_m"])
    ]:
        lines.append(
            "Not mapped because outside the map, which reaches "
            f"from ({x_min:.1f}, {y_min:.1f}) to ({x_max:.1f}, {y_max:.1f}) m: "
            f"{', '.join(outside)}."
        )
    return [*lines, run]


def _row(place: Mapping[str, Any]) -> tuple[str, ...]:
    verdict = "yes" if place["found"] else "no"
    if not place["known"]:
        verdict = "unknown word"
    elif not place["mapped"]:
        verdict = "not mapped"
    scores = [
        "-" if place[key] is None else f"{place[key]:.2f}"
        for key in ("best_here", "best_elsewhere", "looks_like_score")
    ]
    return (
        place["name"],
        *(f"{place[key]:.2f}" for key in ("x", "y", "radius_m")),
        *scores[:2],
        str(place["rank"] or "-"),
        verdict,
        f"{place['looks_like']} {scores[2]}" if place["looks_like"] else "-",
    )
