"""The floor is chosen from unrelated words, and the rates say what it costs."""

from __future__ import annotations

import json

import numpy as np
import pytest

from onemap_perception.encoders.mini import SHIPPED, MiniEncoder, MiniParams
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench import queries
from onemap_tools.bench.mapping import map_scene
from onemap_tools.bench.queries import (
    STYLES,
    EncoderPair,
    QueryBenchParams,
    QueryOutcome,
    QueryWord,
    choose_floor,
    failing,
    query_map,
    query_words,
    rates,
    run_configured,
    summarise,
    table_lines,
)
from tests.perception.toy import ColourEncoder
from tests.simulator.scenes import box_room

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


def test_what_is_asked_needs_no_sentence_encoder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("onemap_perception.encoders.mini.find_model_folder", lambda: None)
    vocabulary = load_vocabulary(SHIPPED)
    words = query_words(vocabulary)
    MiniEncoder(MiniParams()).embed_text([word.text for word in words])
    named = {
        word for e in vocabulary.classes for word in (*e.aliases, *e.held_out, *e.query_aliases)
    }
    assert not named & {word.text for word in words if word.group == "unrelated"}
    assert {"floor", "wall", "ceiling"}.isdisjoint(word.category for word in words)


@pytest.fixture(scope="module")
def room() -> Scene:
    return box_room()


def test_a_map_made_here_knows_what_it_was_shown(room: Scene) -> None:
    encoder = ColourEncoder()
    mapped = map_scene(room, encoder, seed=3, pictures=12)
    assert mapped.observed >= {"sofa", "ball", "floor"}
    assert mapped.belief.frames_fused == 12
    words = (
        QueryWord("red", "sofa", "names"),
        QueryWord("blue", "", "unrelated"),
        QueryWord("green", "bed", "names"),
    )
    questions = list(zip(words, EncoderPair(encoder, encoder).queries(words), strict=True))
    red, blue, green = query_map(mapped, questions, 3)
    assert (red.present, red.near) == (True, True)
    assert (blue.present, blue.near) == (False, False)
    assert not green.present
    assert red.score > blue.score


def test_the_report_holds_rates_of_every_group_and_becomes_a_table(
    monkeypatch: pytest.MonkeyPatch, room: Scene
) -> None:
    monkeypatch.setattr(queries, "generate_apartment", lambda seed, style: room)
    params = QueryBenchParams((800, 801), STYLES["training"], images=3)
    done: list[int] = []
    document = run_configured(MiniParams(), params, done.append)
    assert (document["benchmark"], document["pictures"]) == ("queries", 3)
    assert document["encoder_id"].startswith("mini-")
    assert done == [1, 2]
    assert 0 < document["floor"] < 1
    assert set(document["rates"]) == {"names", "synonyms", "aliases", "unrelated"}
    json.dumps(document, allow_nan=False)
    head, columns, *rows = table_lines(document)
    assert f"floor {document['floor']:g}" in head
    assert columns.split()[0] == "words"
    assert [row.split()[0] for row in rows] == list(document["rates"])
