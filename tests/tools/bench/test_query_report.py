"""The floor is chosen from unrelated words, and the rates tell what it costs."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_tools.bench.queries import STYLES
from onemap_tools.bench.query_report import (
    QueryBenchParams,
    QueryOutcome,
    QueryWord,
    choose_floor,
    failing,
    rates,
    summarise,
)

SOFA, LOO = QueryWord("sofa", "sofa", "names"), QueryWord("loo", "toilet", "synonyms")
TOILET, CAR = QueryWord("toilet", "toilet", "names"), QueryWord("car", "", "unrelated")


def outcome(
    word: QueryWord, score: float, *, near: bool | None = None, seed: int = 1
) -> QueryOutcome:
    """``near`` None: the thing is absent."""
    return QueryOutcome(word, seed, near is not None, score, bool(near))


def test_rates_count_absent_and_present_words_apart() -> None:
    answers = [
        outcome(SOFA, 0.9, near=True),
        outcome(SOFA, 0.5, near=False),
        outcome(SOFA, 0.1, near=True),
        outcome(SOFA, 0.4),
        outcome(SOFA, 0.2),
    ]
    assert rates(answers, 0.3) == {
        "absent": 2,
        "false_positive_rate": 0.5,
        "present": 3,
        "answered_rate": 0.667,
        "right_rate": 0.333,
    }
    assert rates([], 0.3)["right_rate"] is None


def test_the_floor_lets_one_unrelated_word_in_twenty_through() -> None:
    answers = [outcome(CAR, score) for score in np.linspace(0.005, 0.195, 20)]
    floor = choose_floor([*answers, outcome(SOFA, 0.99)])
    assert floor == 0.19
    assert rates(answers, floor)["false_positive_rate"] == 0.05
    with pytest.raises(ValueError, match="no floor"):
        choose_floor([outcome(CAR, 0.999)])


def test_the_floor_is_chosen_on_odd_and_measured_on_even_seeds() -> None:
    odd = [outcome(CAR, 0.105, seed=801), outcome(SOFA, 0.9, near=True, seed=801)]
    even = [outcome(CAR, 0.5, seed=802), outcome(SOFA, 0.1, near=True, seed=802)]
    found = summarise([*odd, *even], QueryBenchParams((801, 802), STYLES["training"], images=1))
    assert found["floor"] == 0.11
    assert found["rates"]["unrelated"]["false_positive_rate"] == 1.0
    assert found["rates"]["names"]["right_rate"] == 0.0
    assert found["without_floor"]["names"]["right_rate"] == 1.0


def test_words_that_fail_where_their_class_does_not_are_listed() -> None:
    answers = [
        outcome(TOILET, 0.9, near=True),
        outcome(LOO, 0.9, near=False),
        outcome(LOO, 0.1, near=True),
    ]
    assert failing(answers, 0.2) == {"loo": 0.0}
    assert failing([*answers[:1], outcome(LOO, 0.8, near=True)], 0.2) == {}
