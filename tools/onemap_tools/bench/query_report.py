"""The report of a benchmark of queries: floor, error rates and failing words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from onemap_simulator.generation.style import Style

FLOORS = tuple(round(0.01 * step, 2) for step in range(1, 100))
SHOWN_FLOORS = (0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5)
MAX_FALSE_POSITIVE_RATE = 0.05  # of unrelated words, at the chosen floor


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
